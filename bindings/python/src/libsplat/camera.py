"""Pinhole cameras: made by formulas, and read from files."""
from ctypes import byref, c_char_p, c_double, c_size_t, c_uint32, sizeof
from typing import Any, List, Optional, Sequence, Tuple, Union, overload

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._arrays import ArrayLike, File, address, doubles, file_of, frozen
from ._errors import InvalidArgument, check, kind_of
from ._library import lib
from ._text import PathLike, bytes_from, encoded, flags_of, json_from, path_of
from .device import real, whole
from .scene import Scene

UP = (0.0, -1.0, 0.0)  # scenes have y down
FOV = 0.7


# The smallest determinant of a rotation that `render` takes.
LEAST_DETERMINANT = 1e-9


def _pose(matrix: ArrayLike) -> NDArray[np.float64]:
    """A pose [4,4] that `render` takes. Raises InvalidArgument, ShapeMismatch."""
    pose = doubles(matrix, (4, 4), "world_to_camera")
    if not np.isfinite(pose).all():
        raise InvalidArgument("world_to_camera has numbers that are not finite")
    if pose[3].tolist() != [0, 0, 0, 1]:
        raise InvalidArgument(f"the last row of world_to_camera is {pose[3].tolist()}, expected "
                              "[0, 0, 0, 1]: is it transposed?")
    size = float(np.linalg.det(pose[:3, :3]))
    if not size > LEAST_DETERMINANT:
        raise InvalidArgument(f"the rotation of world_to_camera has the determinant {size:g}, "
                              "expected about 1: " + ("it mirrors" if size < 0 else "it is singular"))
    return pose


class _Intrinsic:
    """A property that reads and writes a number of a camera."""

    def __init__(self, about: str) -> None:
        self.__doc__ = about

    def __set_name__(self, owner: Any, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, camera: None, owner: Any) -> "_Intrinsic": ...

    @overload
    def __get__(self, camera: "Camera", owner: Any) -> float: ...

    def __get__(self, camera: "Optional[Camera]", owner: Any) -> "Union[_Intrinsic, float]":
        return self if camera is None else float(getattr(camera.raw, self._name))

    def __set__(self, camera: "Camera", value: float) -> None:
        camera._set(**{self._name: value})


class Camera:
    """A pinhole camera; the centre of the pixel in column i and row j is (i + 0.5, j + 0.5).

    width, height    pixels
    fx, fy           focal lengths, pixels; fy None: fx
    cx, cy           principal point, pixels; None: the middle
    world_to_camera  [4,4], last row 0 0 0 1, axes of OpenCV: x right, y down, z forward; None: the
                     identity
    name             of its image in a file, else empty
    Raises InvalidArgument, ShapeMismatch: what `render` would refuse.
    """

    __slots__ = ("raw", "name", "__weakref__")

    def __init__(self, width: int, height: int, fx: float, fy: Optional[float] = None,
                 cx: Optional[float] = None, cy: Optional[float] = None,
                 world_to_camera: Optional[ArrayLike] = None, name: str = "") -> None:
        raw = _native.splat_camera(width=whole(width, "width"), height=whole(height, "height"))
        matrix = _pose(np.eye(4) if world_to_camera is None else world_to_camera)
        raw.world_to_camera[:] = matrix.ravel().tolist()
        self.raw, self.name = raw, name
        self._set(fx=fx, fy=fx if fy is None else fy, cx=width / 2 if cx is None else cx,
                  cy=height / 2 if cy is None else cy)

    def _set(self, **numbers: Any) -> None:
        """Set fx, fy, cx and cy, or none of them if the library refuses one."""
        raw = _native.splat_camera.from_buffer_copy(self.raw)
        for name, value in numbers.items():
            setattr(raw, name, real(value, name))
        raw.world_to_camera[:] = np.eye(4).ravel().tolist()  # `render` takes more poses than files do
        try:
            check(lib.splat_camera_save_memory(byref(raw), None, 1, None, 0, byref(c_size_t())))
        except InvalidArgument as error:
            raise InvalidArgument(f"this Camera is refused: {error.message.split(': ', 1)[1]}") from None
        raw.world_to_camera[:] = self.raw.world_to_camera[:]
        self.raw = raw

    @classmethod
    def _of(cls, raw: _native.splat_camera, name: str = "") -> "Camera":
        camera = cls.__new__(cls)
        camera.raw = _native.splat_camera.from_buffer_copy(raw)
        camera.name = name
        return camera

    @classmethod
    def from_fov(cls, width: int, height: int, fov_x: float = FOV) -> "Camera":
        """Square pixels and a horizontal field of view in radians; the pose is the identity."""
        raw = _native.splat_camera()
        check(lib.splat_camera_from_fov(whole(width, "width"), whole(height, "height"), fov_x,
                                        byref(raw)))
        return cls._of(raw)

    @classmethod
    def look_at(cls, eye: ArrayLike, target: ArrayLike, up: ArrayLike = UP, *, width: int = 512,
                height: int = 512, fov_x: float = FOV) -> "Camera":
        """A camera at `eye` that looks at `target`, with `up` upwards in the image.

        Raises InvalidArgument: eye and target coincide, up is parallel to the view.
        """
        camera = cls.from_fov(width, height, fov_x)
        camera.aim(eye, target, up)
        return camera

    @classmethod
    def from_opengl(cls, camera_to_world: ArrayLike, *, width: int = 512, height: int = 512,
                    fov_x: float = FOV) -> "Camera":
        """A camera with the pose of NeRF's transform_matrix [4,4]: x right, y up, z backwards."""
        camera = cls.from_fov(width, height, fov_x)
        matrix = doubles(camera_to_world, (4, 4), "camera_to_world")
        check(lib.splat_camera_from_opengl(byref(camera.raw), (c_double * 16)(*matrix.ravel())))
        return camera

    @classmethod
    def orbit(cls, scene: Scene, count: int, *, width: int = 512, height: int = 512,
              fov_x: float = FOV, elevation: float = 0.0, start: float = 0.0,
              distance: float = 0.0, up: ArrayLike = UP) -> "List[Camera]":
        """Cameras at equal angles on a circle around the centre of a scene.

        elevation, start  radians above the horizon; angle of the first camera
        distance          from the centre, scene units; 0: the scene fills the image
        """
        desc = _native.splat_orbit_desc(struct_size=sizeof(_native.splat_orbit_desc))
        desc.width, desc.height = whole(width, "width"), whole(height, "height")
        desc.fov_x, desc.elevation, desc.start = fov_x, elevation, start
        desc.distance = distance
        desc.up[:] = doubles(up, (3,), "up").tolist()
        raw = (_native.splat_camera * whole(count, "count"))()
        check(lib.splat_camera_orbit(scene.handle, byref(desc), len(raw), raw))
        return [cls._of(each) for each in raw]

    @classmethod
    def path(cls, keys: "Sequence[Camera]", count: int, *, closed: bool = False) -> "List[Camera]":
        """Cameras along a smooth path through `keys`, with the size and lens of the first one.

        closed   the path returns to its first key
        Raises InvalidArgument: fewer than two different poses.
        """
        raw = (_native.splat_camera * whole(count, "count"))()
        given = (_native.splat_camera * len(keys))(*(each.raw for each in keys))
        check(lib.splat_camera_path(given, len(given), int(closed), len(raw), raw))
        return [cls._of(each) for each in raw]

    @classmethod
    def load(cls, source: Union[File, Tuple[File, File]], *,
             ignore_distortion: bool = False, width: int = 0, height: int = 0) -> "List[Camera]":
        """Read the cameras of a NeRF transforms.json or of a COLMAP model.

        source             path of the json file or of the model's folder; or the bytes of the json
                           file, or of COLMAP's (cameras, images) files; or these files, open
        ignore_distortion  read cameras with lens distortion as if they had none
        width, height      pixels, for a transforms.json that has no size
        Raises NotFound, IoError, FormatError, Unsupported (distortion, another lens model).
        """
        desc = _native.splat_camera_file_desc(struct_size=sizeof(_native.splat_camera_file_desc))
        desc.flags = flags_of((ignore_distortion, _native.CameraFlags.IGNORE_DISTORTION))
        desc.width, desc.height = whole(width, "width"), whole(height, "height")
        count = c_uint32()
        given = source if isinstance(source, tuple) else (source,)
        parts = [file_of(each, "source") for each in given]
        if len(parts) not in (1, 2) or (len(parts) == 2 and any(path is not None for _, path in parts)):
            raise InvalidArgument("source has paths or the wrong number of parts, expected the bytes "
                                  "of (cameras, images)")
        data, path = parts[0]
        place: Any = path
        if data is not None:
            files = _native.splat_camera_bytes(struct_size=sizeof(_native.splat_camera_bytes))
            files.cameras, files.camera_bytes = address(data), data.size
            if len(parts) == 2:
                images, _ = parts[1]
                assert images is not None
                files.images, files.image_bytes = address(images), images.size
            function, report = lib.splat_camera_load_memory, lib.splat_camera_load_memory_report
            place = byref(files)
        else:
            function, report = lib.splat_camera_load, lib.splat_camera_load_report
        check(function(place, byref(desc), None, 0, byref(count)))
        raw = (_native.splat_camera * count.value)()
        check(function(place, byref(desc), raw, count.value, byref(count)))
        names = json_from(report, place, byref(desc))["names"]
        return [cls._of(each, name) for each, name in zip(raw, names)]

    def aim(self, eye: ArrayLike, target: ArrayLike, up: ArrayLike = UP) -> None:
        """Move the camera, as `look_at` does; the intrinsics stay."""
        places = [(c_double * 3)(*doubles(each, (3,), what))
                  for each, what in ((eye, "eye"), (target, "target"), (up, "up"))]
        check(lib.splat_camera_look_at(byref(self.raw), *places))

    def to_opengl(self) -> NDArray[np.float64]:
        """The pose as an OpenGL camera-to-world matrix [4,4]."""
        matrix = (c_double * 16)()
        check(lib.splat_camera_to_opengl(byref(self.raw), matrix))
        return np.array(matrix).reshape(4, 4)

    @property
    def world_to_camera(self) -> NDArray[np.float64]:
        """[4,4] from scene units to the camera's axes; a copy that cannot be written.

        Assign to it to change the pose: change a copy() of it, then assign that.
        """
        return frozen(np.array(self.raw.world_to_camera).reshape(4, 4))

    @world_to_camera.setter
    def world_to_camera(self, matrix: ArrayLike) -> None:
        self.raw.world_to_camera[:] = _pose(matrix).ravel().tolist()

    @property
    def width(self) -> int:
        """Pixels."""
        return int(self.raw.width)

    @property
    def height(self) -> int:
        """Pixels."""
        return int(self.raw.height)

    fx = _Intrinsic("Focal length in x, pixels.")
    fy = _Intrinsic("Focal length in y, pixels.")
    cx = _Intrinsic("Principal point in x, pixels.")
    cy = _Intrinsic("Principal point in y, pixels.")

    @property
    def intrinsics(self) -> Tuple[float, float, float, float]:
        """fx, fy, cx, cy in pixels."""
        return (self.raw.fx, self.raw.fy, self.raw.cx, self.raw.cy)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Camera):
            return NotImplemented
        return bytes(self.raw) == bytes(other.raw) and self.name == other.name

    __hash__ = None  # type: ignore[assignment]  # it can change

    def __reduce__(self) -> Any:
        rows = tuple(map(tuple, self.world_to_camera.tolist()))
        return (Camera, (self.width, self.height, *self.intrinsics, rows, self.name))

    def __replace__(self, **changes: Any) -> "Camera":
        """What copy.replace of Python 3.13 calls: a camera with other arguments of its making."""
        names = ("width", "height", "fx", "fy", "cx", "cy", "world_to_camera", "name")
        return Camera(**{**{name: getattr(self, name) for name in names}, **changes})

    def __repr__(self) -> str:
        name = f", name={self.name!r}" if self.name else ""
        return f"Camera({self.width}, {self.height}, fx={self.raw.fx:g}{name})"


def camera_array(cameras: Union[Camera, Sequence[Camera]], what: str = "cameras") -> Any:
    """The library's array of cameras."""
    given = [cameras] if isinstance(cameras, Camera) else list(cameras)
    for each in given:
        if not isinstance(each, Camera):
            raise InvalidArgument(f"{what} has {kind_of(each)}, expected a Camera")
    return (_native.splat_camera * len(given))(*(each.raw for each in given))


def _names(cameras: Sequence[Camera]) -> Any:
    return (c_char_p * len(cameras))(*(encoded(each.name, "name") for each in cameras))


def save_cameras(path: PathLike, cameras: Sequence[Camera]) -> None:
    """Write cameras and their names as a NeRF transforms.json, whole or not at all.

    Raises NotFound (the folder), IoError, InvalidArgument (an invalid camera).
    """
    check(lib.splat_camera_save(path_of(path), camera_array(cameras), _names(cameras),
                                len(cameras)))


def cameras_to_bytes(cameras: Sequence[Camera]) -> bytes:
    """The bytes of such a file."""
    return bytes_from(lib.splat_camera_save_memory, camera_array(cameras), _names(cameras),
                      len(cameras))
