"""Read event topics of ROS bags through eventcv."""

from __future__ import annotations

from typing import ClassVar

from tiegocancel.files.eventcv_bridge import EventcvReader

__all__ = ["RosbagReader"]

_MESSAGE = "EventArray"


class RosbagReader(EventcvReader):
    """Decode the one topic of ``dvs_msgs/EventArray`` in a bag; times and size are those of its messages."""

    format: ClassVar[str] = "rosbag"
    suffix: ClassVar[str] = ".bag"

    def _prepare(self) -> None:
        with self._one_line(), self._named() as path:
            topics = [str(name) for name, kind in self._eventcv.bag_topics(path) if str(kind).endswith(_MESSAGE)]
        if len(topics) != 1:
            found = ", ".join(topics) or "none"
            raise self.fail("", f"expected one topic of {_MESSAGE}, found {found}")
        self.note(f"topic {topics[0]}")
        self._arguments = {"time_unit": "microseconds", "topic": topics[0]}
