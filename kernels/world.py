"""Render what a turning pinhole camera sees of a far cube of walls."""

from tiegocancel.kernels.render import bilinear, clamp
from tiegocancel.kernels.runtime import start, ti

__all__ = ["render_world"]


@ti.func
def place(tangent: ti.f32) -> ti.f32:
    """Return where on a wall, from −1 to 1, the direction with this tangent meets the painting."""
    return tangent * (1.2 - 0.2 * tangent * tangent)


@ti.kernel
def render_world_kernel(
    pixels: ti.types.ndarray(ti.i32, ndim=1),  # (n,) y * width + x
    wall: ti.types.ndarray(ti.f32, ndim=2),  # (side, side) log-intensity of each wall, its middle in the middle
    attitude: ti.types.ndarray(ti.f32, ndim=3),  # (steps, 3, 3) camera directions to world directions
    levels: ti.types.ndarray(ti.f32, ndim=2),  # (n, steps) out: log-intensity
    width: ti.i32,
    focal_px: ti.f32,
    principal_x_px: ti.f32,
    principal_y_px: ti.f32,
):
    """Turn each pixel's ray into the world, find the wall it meets, sample the painting there."""
    middle = 0.5 * ti.cast(wall.shape[0] - 1, ti.f32)
    last = ti.cast(wall.shape[0], ti.f32) - 1.01
    for i in range(pixels.shape[0]):
        pixel = pixels[i]
        x = ti.cast(pixel % width, ti.f32)
        y = ti.cast(pixel // width, ti.f32)
        right = (x - principal_x_px) / focal_px
        down = (y - principal_y_px) / focal_px
        for step in range(attitude.shape[0]):
            ray_x = attitude[step, 0, 0] * right + attitude[step, 0, 1] * down + attitude[step, 0, 2]
            ray_y = attitude[step, 1, 0] * right + attitude[step, 1, 1] * down + attitude[step, 1, 2]
            ray_z = attitude[step, 2, 0] * right + attitude[step, 2, 1] * down + attitude[step, 2, 2]
            # The wall before or behind (z), beside (x) or above or below (y): the longest component decides.
            across = ray_x
            along = ray_y
            depth = ti.abs(ray_z)
            if ti.abs(ray_x) > depth and ti.abs(ray_x) >= ti.abs(ray_y):
                across = ray_z
                depth = ti.abs(ray_x)
            elif ti.abs(ray_y) > depth:
                along = ray_z
                depth = ti.abs(ray_y)
            inverse = 1.0 / depth
            column = clamp(middle * (1.0 + place(across * inverse)), last)
            row = clamp(middle * (1.0 + place(along * inverse)), last)
            value = bilinear(wall, column, row)
            # Never taken. It keeps the compiler from summing the above in another order, which would move a tenth of
            # the events of this scene by a microsecond against recordings that exist.
            if x < 0.0:
                value += wall[0, 0] * (wall[1, 1] - value)
            levels[i, step] = value


def render_world(
    pixels,
    *,
    wall,
    attitude,
    width,
    height,
    focal_px,
    principal_px,
    levels,
):
    """Fill ``levels`` float32[n, steps] with the log-intensity of ``pixels`` int32[n].

    ``wall`` float32[side, side] is the painting on all six walls of the cube, by its map
    m(u) = u·(1.2 − 0.2·u²) of the tangent u; ``attitude`` float32[steps, 3, 3] takes directions of the camera (x
    right, y down, z forward) to those of the world. Raise ``ValueError`` when a pixel index lies outside the sensor or
    the shapes differ.
    """
    start()
    shape = (len(pixels), len(attitude))
    if levels.shape != shape:
        raise ValueError(f"levels must be of shape {shape}, not {levels.shape}")
    if attitude.shape != (shape[1], 3, 3):
        raise ValueError(f"attitude must be of shape {(shape[1], 3, 3)}, not {attitude.shape}")
    if wall.shape[0] != wall.shape[1] or len(wall) < 2:
        raise ValueError(f"wall must be square with at least 2 × 2 samples, not {wall.shape}")
    if len(pixels) == 0:
        return
    size = width * height
    if int(pixels.min()) < 0 or int(pixels.max()) >= size:
        raise ValueError(f"pixels must be from 0 to {size - 1}, not {int(pixels.min())} to {int(pixels.max())}")
    render_world_kernel(
        pixels,
        wall,
        attitude,
        levels,
        width,
        float(focal_px),
        float(principal_px[0]),
        float(principal_px[1]),
    )
