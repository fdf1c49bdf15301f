"""ROS 2 messages of camera images."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from seals.rendering.camera_view import Shot
from seals.rendering.optics import to_bytes

CAMERA = {
    "image_raw": "sensor_msgs/msg/Image",
    "camera_info": "sensor_msgs/msg/CameraInfo",
    "depth/image_raw": "sensor_msgs/msg/Image",
    "points": "sensor_msgs/msg/PointCloud2",
}
"""Type of each topic of a camera, below its name."""


def camera_messages(store: Any, head: Any, shot: Shot) -> Iterator[tuple[str, str, Any]]:
    """Yield topic, type and message of the outputs of a camera: image, depth, points, intrinsics.

    Args:
        store: message types.
        head: header in the camera's optical frame.
        shot: the image.
    """
    depth = np.asarray(shot.picture.depth, dtype=np.float32)
    if "rgb" in shot.what:
        colour = to_bytes(np.asarray(shot.picture.colour))
        yield "image_raw", CAMERA["image_raw"], _image(store, head, colour, "rgb8")
    lens = shot.lens
    k = np.array([lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0])
    # ROS counts pixels from the middle of the first one
    k[[2, 5]] -= 0.5
    region = store.types["sensor_msgs/msg/RegionOfInterest"](
        x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
    )
    yield (
        "camera_info",
        CAMERA["camera_info"],
        store.types["sensor_msgs/msg/CameraInfo"](
            header=head,
            height=lens.height,
            width=lens.width,
            distortion_model="plumb_bob",
            d=np.zeros(5),
            k=k,
            r=np.eye(3).reshape(-1),
            p=np.insert(k.reshape(3, 3), 3, 0.0, axis=1).reshape(-1),
            binning_x=0,
            binning_y=0,
            roi=region,
        ),
    )
    if "depth" in shot.what:
        # where nothing is met the depth is infinite, as REP 118 has it
        yield "depth/image_raw", CAMERA["depth/image_raw"], _image(store, head, depth, "32FC1")
        yield "points", CAMERA["points"], _points(store, head, shot, depth)


def _image(store: Any, head: Any, pixels: Any, encoding: str) -> Any:
    rows = np.ascontiguousarray(pixels)
    height, width = rows.shape[:2]
    raw = rows.view(np.uint8).reshape(-1)
    return store.types["sensor_msgs/msg/Image"](
        header=head,
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=0,
        step=len(raw) // height,
        data=raw,
    )


def _points(store: Any, head: Any, shot: Shot, depth: Any) -> Any:
    """Points in optical axes, of all pixels where something is met."""
    lens = shot.lens
    v, u = np.indices(depth.shape)
    met = np.isfinite(depth)
    z = depth[met]
    x, y = (u[met] + 0.5 - lens.cx) / lens.fx * z, (v[met] + 0.5 - lens.cy) / lens.fy * z
    data = np.stack([x, y, z], axis=1).astype("<f4")
    field = store.types["sensor_msgs/msg/PointField"]
    return store.types["sensor_msgs/msg/PointCloud2"](
        header=head,
        height=1,
        width=len(data),
        fields=[field(name=n, offset=4 * k, datatype=7, count=1) for k, n in enumerate("xyz")],
        is_bigendian=False,
        point_step=12,
        row_step=12 * len(data),
        data=data.view(np.uint8).reshape(-1),
        is_dense=True,
    )
