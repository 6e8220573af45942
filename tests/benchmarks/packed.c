/* The rule of semantics.md in plain C over the same packed state: the yardstick for the kernel, one thread.
 *
 * Built and called by bench_canceller.py, once with the window in a loop and once with WINDOW compiled in. Cells: t' << 2 | p << 1 | valid, t' in 30 bits from a base that the caller
 * keeps below 2^29 µs; a border as wide as the gate; offsets nearest first. */
#include <stdint.h>

struct state {
    int64_t head, pending, suppressed, predicted, outside, overflow, overwritten;
};

void cancel(int64_t n, const int64_t *t, const uint16_t *x, const uint16_t *y, const uint8_t *p, int64_t base_us,
            uint32_t horizon_us, uint32_t gate_us, int32_t width, int32_t height, int32_t stride, int32_t origin,
            int32_t capacity, const int32_t *restrict offsets, int32_t window, const int64_t *restrict coefficients,
            uint32_t *restrict cells, int64_t *restrict cell_source, uint64_t *restrict ring,
            int64_t *restrict ring_source, struct state *state, uint8_t *restrict suppressed, int64_t *restrict source,
            int64_t index)
{
    int32_t head = (int32_t)state->head, pending = (int32_t)state->pending;
    const int64_t a = coefficients[0], b = coefficients[1], c = coefficients[2] + 32768;
    const int64_t d = coefficients[3], e = coefficients[4], f = coefficients[5] + 32768;
    const uint32_t twice = gate_us << 1;
    struct state s = *state;

    for (int64_t i = 0; i < n; i++, index++) {
        const uint32_t now = (uint32_t)(t[i] - base_us), sign = p[i];
        const int32_t here = origin + y[i] * stride + x[i];

        while (pending > 0) {
            const uint64_t packed = ring[head];
            if (((uint32_t)packed >> 2) > now + gate_us)
                break;
            const int32_t cell = (int32_t)(packed >> 32);
            const uint32_t old = cells[cell];
            s.overwritten += (old & 1) && (old >> 2) + gate_us >= now;
            cells[cell] = (uint32_t)packed;
            if (source)
                cell_source[cell] = ring_source[head];
            if (++head == capacity)
                head = 0;
            pending--;
        }

        const uint32_t want = ((now - gate_us) << 2) | (sign << 1) | 1u;
        int32_t met = -1;
#ifdef WINDOW /* the offsets themselves, as a list: unrolled by hand */
        (void)offsets, (void)window;
#define LOOK(offset)                                                                                                   \
    {                                                                                                                  \
        const uint32_t gap = cells[here + (offset)] - want;                                                            \
        if (((gap >> 2) | (gap << 30)) <= twice) {                                                                     \
            met = here + (offset);                                                                                     \
            goto found;                                                                                                \
        }                                                                                                              \
    }
        WINDOW
#else
        for (int32_t k = 0; k < window; k++) {
            const uint32_t gap = cells[here + offsets[k]] - want;
            if (((gap >> 2) | (gap << 30)) <= twice) {
                met = here + offsets[k];
                goto found;
            }
        }
#endif
        goto predict;
    found:
        cells[met] = 0;
        suppressed[i] = 1;
        s.suppressed++;
        if (source)
            source[i] = cell_source[met];

    predict:;

        const int64_t wide = x[i], tall = y[i];
        const int64_t ahead_x = ((wide << 16) + a * wide + b * tall + c) >> 16;
        const int64_t ahead_y = ((tall << 16) + d * wide + e * tall + f) >> 16;
        if (ahead_x < 0 || ahead_x >= width || ahead_y < 0 || ahead_y >= height) {
            s.outside++;
        } else if (pending == capacity) {
            s.overflow++;
        } else {
            int32_t tail = head + pending;
            if (tail >= capacity)
                tail -= capacity;
            ring[tail] = (uint64_t)(origin + (int32_t)ahead_y * stride + (int32_t)ahead_x) << 32
                         | ((now + horizon_us) << 2 | sign << 1 | 1u);
            if (source)
                ring_source[tail] = index;
            pending++;
            s.predicted++;
        }
    }
    s.head = head;
    s.pending = pending;
    *state = s;
}
