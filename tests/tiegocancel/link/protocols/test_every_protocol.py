"""What holds for every wire protocol: exact round trips, any fragmentation, losses that stay small and are counted."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tiegocancel import Events
from tiegocancel.errors import ConfigError
from tiegocancel.link.protocols import registry
from tiegocancel.link.protocols.options import ProtocolOptions

from .conftest import counted, decoded, encoded, lost_and_false, rows, spoil, stream

FEW = settings(max_examples=8, suppress_health_check=[HealthCheck.function_scoped_fixture])
Named = tuple[str, ProtocolOptions]


@given(seed=st.integers(0, 1000), n=st.integers(1, 300), step_us=st.sampled_from([0, 1, 20, 400]))
@FEW
def test_a_round_trip_is_exact(options: Named, seed: int, n: int, step_us: int) -> None:
    name, chosen = options
    events = stream(seed, n, step_us=step_us)
    decoder = registry.decoder(name, chosen)
    came = decoded(decoder, encoded(name, chosen, events))
    assert rows(came) == rows(events)
    assert decoder.counters.events == n
    assert decoder.counters.bad_bytes == decoder.counters.time_jumps == decoder.counters.lost_events == 0


@given(
    seed=st.integers(0, 1000),
    cuts=st.lists(st.integers(0, 1000), max_size=12),
    share=st.sampled_from([0.0, 0.004, 0.03]),
)
@FEW
def test_any_fragmentation_gives_the_same_events_and_counts(
    options: Named, seed: int, cuts: list[int], share: float
) -> None:
    name, chosen = options
    data = encoded(name, chosen, stream(seed, 120))
    if share:
        data, _ = spoil(data, seed, share)
    whole, cut, bytewise = (registry.decoder(name, chosen) for _ in range(3))
    at_once = decoded(whole, data)
    assert rows(decoded(cut, data, [c for c in cuts if c < len(data)])) == rows(at_once)
    assert rows(decoded(bytewise, data, range(1, len(data)))) == rows(at_once)
    assert counted(cut.counters) == counted(bytewise.counters) == counted(whole.counters)
    assert cut.take_lines() == whole.take_lines()


@given(data=st.binary(max_size=2000))
@FEW
def test_any_bytes_give_events_in_order_and_no_error(options: Named, data: bytes) -> None:
    name, chosen = options
    decoder = registry.decoder(name, chosen)
    came = decoded(decoder, data)
    assert decoder.counters.bytes == len(data)
    assert decoder.counters.events == len(came)


def test_chunks_may_be_cut_anywhere_when_encoding(options: Named) -> None:
    name, chosen = options
    events = stream(3, 500)
    encoder = registry.encoder(name, chosen)
    parts = [encoder.begin(), *(encoder.encode(events[a : a + 37]) for a in range(0, 500, 37)), encoder.end()]
    assert rows(decoded(registry.decoder(name, chosen), b"".join(parts))) == rows(events)


# What a spoilt byte may cost on average, lost and false. A lost step of E1 shifts all times behind it: it has no bound.
BOUNDS = {
    "edvs-E2": (2.5, 1.5), "edvs-E3": (2.0, 1.0), "edvs-E4": (2.0, 1.0),
    "evt2": (2.5, 2.0), "evt3": (10.0, 9.0), "openmv": (2.5, 1.0), "framed": (192.0, 0.05),
}  # fmt: skip


@pytest.mark.parametrize("share", [0.001, 0.01])
@pytest.mark.parametrize("case", BOUNDS)
def test_losses_and_false_events_stay_small_per_spoilt_byte(case: str, share: float) -> None:
    name, _, edvs_format = case.partition("-")
    chosen = ProtocolOptions(width=128, height=128, edvs_format=edvs_format or "E3")
    events = stream(1, 3000)
    lost = false = hits = 0
    for seed in range(2):
        data, count = spoil(encoded(name, chosen, events), seed, share)
        decoder = registry.decoder(name, chosen)
        came = decoded(decoder, data)
        if case == "edvs-E2":
            # A wrap that is taken for a pause shifts all that follows: E2 is held to its 16 bits.
            came = Events(np.sort(came.t % 65_536), came.x, came.y, came.p, 128, 128)
            missing = (len(events) - len(came), max(len(came) - len(events), 0))
        else:
            missing = lost_and_false(events, came)
        lost, false, hits = lost + missing[0], false + missing[1], hits + count
        assert decoder.counters.bad_bytes + decoder.counters.lost_events + decoder.counters.time_jumps > 0
    assert lost / hits <= BOUNDS[case][0]
    assert false / hits <= BOUNDS[case][1]


def test_a_byte_that_is_lost_in_the_middle_costs_a_few_events_and_no_more(options: Named) -> None:
    name, chosen = options
    if chosen.edvs_format == "E1":
        pytest.skip("a lost step of E1 shifts all times behind it")
    events = stream(2, 400, step_us=60)
    data = encoded(name, chosen, events)
    for place in range(len(data) // 2, len(data) // 2 + 40):
        came = decoded(registry.decoder(name, chosen), data[:place] + data[place + 1 :])
        lost, false = lost_and_false(events, came)
        most = 2 * 96 if name == "framed" else 70 if name == "evt3" else 6
        assert lost <= most
        assert false <= (0 if name == "framed" else most)


@pytest.mark.parametrize(
    ("swap_xy", "flip_x", "flip_y"), [(False, True, False), (True, False, True), (True, True, True)]
)
def test_axes_come_back_as_they_were_and_the_wire_has_them_otherwise(
    options: Named, swap_xy: bool, flip_x: bool, flip_y: bool
) -> None:
    name, plain = options
    if name == "framed":
        pytest.skip("the framed protocol says its axes")
    turned = ProtocolOptions(
        width=128, height=128, edvs_format=plain.edvs_format, swap_xy=swap_xy, flip_x=flip_x, flip_y=flip_y
    )
    events = stream(4, 100)
    data = encoded(name, turned, events)
    assert data != encoded(name, plain, events)
    assert rows(decoded(registry.decoder(name, turned), data)) == rows(events)


def test_registry_names_the_nearest_protocol() -> None:
    with pytest.raises(ConfigError, match="did you mean edvs"):
        registry.decoder("edvss")


@pytest.mark.parametrize("name", registry.NAMES)
def test_default_options_make_every_part(name: str) -> None:
    assert registry.decoder(name).feed(b"") is not None
    assert registry.encoder(name).begin() is not None
    assert registry.device(name).receive(b"") == b""
    assert registry.host(name) is not None


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("width", -1),
        ("edvs_format", "E9"),
        ("max_jump_us", 0),
        ("tick_ns", 3),
        ("frame_events", 129),
        ("sensor_bitmap", -1),
    ],
)
def test_options_are_checked(field: str, value: object) -> None:
    with pytest.raises(ConfigError, match=field):
        ProtocolOptions(**{field: value})  # type: ignore[arg-type]
