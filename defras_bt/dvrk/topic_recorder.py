"""Topics of a ROS 1 master into a ROS 1 bag, as they come, whatever their types."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from threading import Lock
from typing import Any

from rosbags.rosbag1 import Writer

from defras_bt.dvrk.ros_packages import ros_module

_LARGEST_MESSAGE = 2**25
_QUEUE = 1000

_OF_ROS = ("/rosout", "/rosout_agg", "/clock")
"""Left out: logs, and the simulated clock, which every message is written at anyway."""


class TopicRecorder:
    """Records from its making to :meth:`close`; the process must be a ROS node already.

    It looks for new topics whenever :meth:`look` is called.
    """

    def __init__(self, file: Path, without: Collection[str] = ()) -> None:
        """``without``: topics that are left out.

        Raises:
            RosMissing: ROS 1 is not installed.
            OSError: the file cannot be written, or exists.
        """
        self._rospy = ros_module("rospy")
        self._without = {*_OF_ROS, *without}
        self._lock = Lock()
        self._connections: dict[tuple[str, str], Any] = {}
        self._subscribers: dict[str, Any] = {}
        self.messages = 0
        self._writer = Writer(file)
        self._writer.open()

    def look(self) -> list[str]:
        """Begin to record topics that are new; returns them."""
        found = []
        for topic, _ in self._rospy.get_published_topics():
            if topic in self._subscribers or topic in self._without:
                continue
            self._subscribers[topic] = self._rospy.Subscriber(
                topic,
                self._rospy.AnyMsg,
                self._take,
                callback_args=topic,
                queue_size=_QUEUE,
                buff_size=_LARGEST_MESSAGE,
                tcp_nodelay=True,
            )
            found.append(topic)
        return found

    def close(self) -> None:
        """Listen no more and finish the bag."""
        for subscriber in self._subscribers.values():
            subscriber.unregister()
        with self._lock:
            self._writer.close()

    def _take(self, message: Any, topic: str) -> None:
        header: Mapping[str, str] = message._connection_header
        now = self._rospy.Time.now()
        with self._lock:
            if self._writer.bio is None:
                return  # closed while this was on its way
            connection = self._connection(topic, header)
            self._writer.write(connection, now.to_nsec(), message._buff)
            self.messages += 1

    def _connection(self, topic: str, header: Mapping[str, str]) -> Any:
        caller = header["callerid"]
        if (topic, caller) not in self._connections:
            self._connections[topic, caller] = self._writer.add_connection(
                topic,
                header["type"].replace("/", "/msg/"),
                msgdef=header["message_definition"],
                md5sum=header["md5sum"],
                callerid=caller,
                latching=int(header.get("latching", "0")),
            )
        return self._connections[topic, caller]
