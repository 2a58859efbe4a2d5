"""Scenes of 3D Gaussians, in memory and in files."""
from ctypes import byref, c_double, c_uint32, c_uint64, c_void_p, sizeof
from typing import (Any, Dict, Iterator, List, NoReturn, Optional, Sequence, Tuple, Type, Union,
                    overload)

import numpy as np

from . import _native
from ._arrays import ArrayLike, File, Floats, address, doubles, file_of, floats, frozen, same
from ._errors import Error, InvalidArgument, check, direct, kind_of
from ._handle import Handle, made
from ._library import lib
from ._records import PointScores, SceneInfo
from ._text import PathLike, bytes_from, choice, flags_of, json_from, path_of
from .device import Device, whole
from .tensor import Tensor

Format = Union[None, int, _native.SceneFormatName]
Axes = Union[None, int, _native.FrameName]


def scene_formats() -> List[Dict[str, Any]]:
    """All formats of scene files: name, extension, what they hold, whether they are written."""
    formats: List[Dict[str, Any]] = json_from(lib.splat_scene_formats)
    return formats


def _file_desc(format: Format, frame: Axes, sh_degree: Optional[int], spz_version: int = 0,
               max_count: int = 0) -> _native.splat_scene_file_desc:
    desc = _native.splat_scene_file_desc(struct_size=sizeof(_native.splat_scene_file_desc))
    desc.format = choice(_native.SceneFormat, format, "format")
    desc.frame = choice(_native.Frame, frame, "frame")
    if sh_degree is not None:
        whole(sh_degree, "sh_degree", 8)
        desc.sh_degree = _native.SPLAT_SH_CONSTANT if sh_degree == 0 else sh_degree
    desc.spz_version = whole(spz_version, "spz_version")
    desc.max_count = whole(max_count, "max_count", 64)
    return desc


class _Attribute:
    """A property that reads and writes an attribute of a scene.

    What it gives cannot be written: a change of a copy, as by scene.means[0] = 0, would be lost.
    """

    def __init__(self, about: str) -> None:
        self.__doc__ = about

    def __set_name__(self, owner: Any, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, scene: None, owner: Any) -> "_Attribute": ...

    @overload
    def __get__(self, scene: "Scene", owner: Any) -> Floats: ...

    def __get__(self, scene: "Optional[Scene]", owner: Any) -> "Union[_Attribute, Floats]":
        return self if scene is None else frozen(scene.read(self._name))

    def __set__(self, scene: "Scene", values: ArrayLike) -> None:
        scene.write(self._name, values)

    def __delete__(self, scene: "Scene") -> None:
        raise TypeError(f"{self._name} of a Scene cannot be deleted: every Gaussian has them")


class Scene(Handle):
    """A set of n Gaussians in host memory, with the axes of 3DGS files: x right, y down, z forward.

    means      [n,3] scene units
    scales     [n,3] standard deviations, > 0; or log_scales, their logarithms. None: 1
    rotations  [n,4] w, x, y, z; None: 1, 0, 0, 0
    opacities  [n] 0 to 1; or opacity_logits. None: 1/2
    sh         [n,K,3], K = (sh_degree + 1)^2, constant term first; None: zeros of sh_degree 0.
               colour = max(0, 0.5 + sum sh_k Y_k(direction))
    drawn_as   `DrawnFlags`: what a file would say of drawing it
    Arrays are float32 and are copied. Those that attributes give are copies that cannot be written:
    change a copy() of one and assign it, as in scene.means = scene.means + 1.
    A scene has n Gaussians as its length. scene[a:b], and scene[indices or mask], are new scenes with
    copies of them. Scenes are equal if all attributes are; copies and pickles leave `report` out.
    Raises InvalidArgument, ShapeMismatch.
    """

    __slots__ = ()
    _kind = "scene"

    means = _Attribute("[n,3] scene units; a copy that cannot be written. Assign to it to change the scene.")
    scales = _Attribute("[n,3] standard deviations, scene units, > 0; a copy.")
    log_scales = _Attribute("[n,3] logarithms of them; a copy.")
    rotations = _Attribute("[n,4] w, x, y, z; a copy.")
    opacities = _Attribute("[n] 0 to 1; a copy.")
    opacity_logits = _Attribute("[n] the same before the sigmoid; a copy.")
    sh = _Attribute("[n,K,3] spherical harmonics, constant term first; a copy.")

    def __init__(self, means: ArrayLike, *, scales: Optional[ArrayLike] = None,
                 log_scales: Optional[ArrayLike] = None, rotations: Optional[ArrayLike] = None,
                 opacities: Optional[ArrayLike] = None, opacity_logits: Optional[ArrayLike] = None,
                 sh: Optional[ArrayLike] = None, drawn_as: int = 0) -> None:
        for names, both in (("scales and log_scales", (scales, log_scales)),
                            ("opacities and opacity_logits", (opacities, opacity_logits))):
            if all(each is not None for each in both):
                raise InvalidArgument(f"{names} exclude each other: give one of them")
        places = floats(means, (None, 3), "means")
        count = places.shape[0]
        desc = _native.splat_scene_desc(struct_size=sizeof(_native.splat_scene_desc), count=count)
        desc.drawn_as = whole(drawn_as, "drawn_as")
        kept: List[Optional[Floats]] = []
        for field, size, what, data, shape in (
                ("means", "mean_count", "means", places, (count, 3)),
                ("log_scales", "log_scale_count", "log_scales", log_scales, (count, 3)),
                ("rotations", "rotation_count", "rotations", rotations, (count, 4)),
                ("opacity_logits", "opacity_logit_count", "opacity_logits", opacity_logits,
                 (count,)),
                ("sh", "sh_count", "sh", sh, (count, None, 3))):
            array = None if data is None else floats(data, shape, what)
            kept.append(array)
            setattr(desc, field, address(array))
            setattr(desc, size, 0 if array is None else array.size)
            if what == "sh" and array is not None:
                desc.sh_degree = _degree(array.shape[1])
        self._own(made("scene", direct, lib.splat_scene_create, byref(desc)))
        if scales is not None:
            self.write("scales", scales)
        if opacities is not None:
            self.write("opacities", opacities)

    @classmethod
    def load(cls, source: File, *, format: Format = None,
             frame: Axes = None, sh_degree: Optional[int] = None, max_count: int = 0,
             lenient: bool = False) -> "Scene":
        """Read a scene from a file, its bytes, or an open file.

        format     "ply", "compressed_ply", "splat" or "spz"; None: by the first bytes, else by the
                   path. The bytes of a .splat have no sign of their own: name it
        frame      axes of the file, such as "rub"; None: the usual ones of the format
        sh_degree  drop or pad bands to this degree, 0 to 3; None: keep all
        max_count  refuse files with more Gaussians; 0: 2^27
        lenient    leave out bytes after the rows that a .ply header counts, with a warning, instead
                   of refusing the file
        Raises NotFound, IoError, FormatError, Unsupported, InvalidArgument.
        """
        desc = _file_desc(format, frame, sh_degree, 0, max_count)
        desc.flags = flags_of((lenient, _native.SceneFlags.LENIENT))
        data, path = file_of(source, "source")
        if data is not None:
            return cls._of(made("scene", direct, lib.splat_scene_load_memory, data.ctypes.data,
                                data.size, byref(desc)))
        return cls._of(made("scene", direct, lib.splat_scene_load, path, byref(desc)))

    @staticmethod
    def peek(path: PathLike, *, format: Format = None) -> Tuple[int, int]:
        """Number of Gaussians of a file and degree of their harmonics, from its head, to decide
        whether to load it. Parameters and errors as in `load`."""
        desc = _file_desc(format, None, None)
        count, degree = c_uint64(), c_uint32()
        check(lib.splat_scene_peek(path_of(path), byref(desc), byref(count), byref(degree)))
        return count.value, degree.value

    def save(self, path: PathLike, *, format: Format = None, frame: Axes = None,
             sh_degree: Optional[int] = None, spz_version: int = 0, clamp: bool = False) -> None:
        """Write a scene to a file, which appears whole or not at all. Parameters as in `load`.

        spz_version  3 or 4; 0: 3
        clamp        write scales that .spz does not hold as the nearest, instead of refusing
                     scenes with more than 1 % of them
        Raises NotFound (the folder), IoError, Unsupported (the format), InvalidArgument.
        """
        desc = _file_desc(format, frame, sh_degree, spz_version)
        desc.flags = flags_of((clamp, _native.SceneFlags.CLAMP))
        check(lib.splat_scene_save(self.handle, path_of(path), byref(desc)))

    def to_bytes(self, format: Format, *, frame: Axes = None, sh_degree: Optional[int] = None,
                 spz_version: int = 0, clamp: bool = False) -> bytes:
        """The bytes of such a file. Parameters and errors as in `save`."""
        desc = _file_desc(format, frame, sh_degree, spz_version)
        desc.flags = flags_of((clamp, _native.SceneFlags.CLAMP))
        return bytes_from(lib.splat_scene_save_memory, self.handle, byref(desc))

    @staticmethod
    def merge(scenes: "Sequence[Scene]") -> "Scene":
        """A new scene with the Gaussians of all, with the highest of their degrees."""
        handles = (c_void_p * len(scenes))(*(scene.handle for scene in scenes))
        return Scene._of(made("scene", direct, lib.splat_scene_merge, handles, len(scenes)))

    @property
    def info(self) -> SceneInfo:
        """Count, bounds, ranges of scales and opacities, memory, fill ratio, and counts of bad values."""
        info = _native.splat_scene_info(struct_size=sizeof(_native.splat_scene_info))
        check(lib.splat_scene_get_info(self.handle, byref(info)))
        return SceneInfo.of(info)

    @property
    def report(self) -> Dict[str, Any]:
        """What was found in the scene's file; empty for a scene without one."""
        found: Dict[str, Any] = json_from(lib.splat_scene_load_report, self.handle)
        return found

    def _size(self) -> Tuple[int, int]:
        """Gaussians and degree, without measuring the scene."""
        count, degree = c_uint64(), c_uint32()
        check(lib.splat_scene_get_size(self.handle, byref(count), byref(degree)))
        return count.value, degree.value

    def __len__(self) -> int:
        return self._size()[0]

    def _state(self) -> Dict[str, Floats]:
        return {name: self.read(name)
                for name in ("means", "log_scales", "rotations", "opacity_logits", "sh")}

    def __getitem__(self, index: Any) -> "Scene":
        """A part as a new scene. Reads all attributes whole, one after another: no other thread may change the scene
        meanwhile."""
        places = np.arange(len(self))[index]
        if places.ndim != 1:
            raise TypeError(f"a Scene is not indexed by {kind_of(index)}: scene[3:4] is a Scene of one "
                            "Gaussian, scene.means[3] its mean")
        parts = {name: array[places] for name, array in self._state().items()}
        return Scene(**parts, drawn_as=self.info.drawn_as)

    def __iter__(self) -> Iterator[NoReturn]:  # else Python would try every index
        raise TypeError("a Scene is no sequence of objects: iterate over an attribute, as in "
                        "for mean in scene.means, or over parts, as in scene[0:100]")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Scene):
            return NotImplemented
        return self is other or same(list(self._state().values()), list(other._state().values()))

    __hash__ = None  # type: ignore[assignment]  # it can change

    def __reduce__(self) -> Any:
        state: Dict[str, Any] = {**self._state(), "drawn_as": self.info.drawn_as}
        return _made_again, (type(self), state), getattr(self, "__dict__", None) or None

    def _repr_png_(self) -> Optional[bytes]:
        from .camera import Camera
        from .rasterizer import render
        try:
            view = Camera.orbit(self, 1, width=320, height=320, elevation=0.4)[0]
            return render(self, view).to_bytes("png")
        except Error:  # no Gaussians, no device: notebooks then show the text
            return None

    @property
    def sh_degree(self) -> int:
        """Degree of the spherical harmonics, 0 to 3."""
        return self._size()[1]

    def _shape(self, name: str) -> Tuple[int, ...]:
        count, degree = self._size()
        columns = {"means": (3,), "scales": (3,), "log_scales": (3,), "rotations": (4,),
                   "opacities": (), "opacity_logits": (), "sh": ((degree + 1)**2, 3)}
        if name not in columns:
            raise InvalidArgument(f"no attribute {name!r}, expected one of {', '.join(columns)}")
        return (count, *columns[name])

    def read(self, name: str) -> Floats:
        """A new array with an attribute, float32, in the shape that the class gives; yours to change."""
        values = np.empty(self._shape(name), np.float32)
        check(lib.splat_scene_read(self.handle, name.encode(), values.ctypes.data, values.nbytes))
        return values

    def write(self, name: str, values: ArrayLike) -> None:
        """Replace an attribute. Raises InvalidArgument for scales and opacities out of range."""
        array = floats(values, self._shape(name), name)
        check(lib.splat_scene_write(self.handle, name.encode(), array.ctypes.data, array.nbytes))

    def tensor(self, name: str, device: Device) -> Tensor:
        """A copy of an attribute on a device. Raises InvalidState for a scene without Gaussians."""
        self._shape(name)
        return Tensor._of(made("tensor", direct, lib.splat_scene_to_tensor, self.handle,
                               name.encode(), device.handle), device)

    def transform(self, rotation: ArrayLike = (1, 0, 0, 0), translation: ArrayLike = (0, 0, 0),
                  scale: float = 1.0) -> None:
        """Apply x -> scale * rotation x + translation to all Gaussians and their harmonics.

        rotation  w, x, y, z of any length > 0
        """
        similarity = _native.splat_similarity(scale=scale)
        similarity.rotation[:] = doubles(rotation, (4,), "rotation").tolist()
        similarity.translation[:] = doubles(translation, (3,), "translation").tolist()
        check(lib.splat_scene_transform(self.handle, byref(similarity)))

    def crop(self, low: ArrayLike, high: ArrayLike) -> None:
        """Keep the Gaussians whose mean lies in a box; its faces belong to it."""
        corners = [(c_double * 3)(*doubles(each, (3,), what))
                   for each, what in ((low, "low"), (high, "high"))]
        check(lib.splat_scene_crop(self.handle, *corners))

    def crop_sphere(self, center: ArrayLike, radius: float) -> None:
        """Keep the Gaussians whose mean lies in a sphere; its surface belongs to it."""
        middle = (c_double * 3)(*doubles(center, (3,), "center"))
        check(lib.splat_scene_crop_sphere(self.handle, middle, radius))

    def set_sh_degree(self, sh_degree: int) -> None:
        """Drop the bands of the harmonics above a degree, 0 to 3; bands that are missing become zeros."""
        check(lib.splat_scene_set_sh_degree(self.handle, whole(sh_degree, "sh_degree")))

    def filter(self, min_opacity: float = 0.0, *, finite: bool = False,
               sort: bool = False) -> None:
        """Keep the Gaussians of at least that opacity.

        finite  drop those with NaN, infinities, or a rotation of length 0
        sort    order the remaining ones along a Morton curve
        """
        flags = flags_of((finite, _native.FilterFlags.FINITE), (sort, _native.FilterFlags.SORT))
        check(lib.splat_scene_filter(self.handle, flags, min_opacity))

    def compare_points(self, points: ArrayLike, threshold: float,
                       min_opacity: float = 1 / 255) -> PointScores:
        """Chamfer distance and F-score of the means of the Gaussians against true points [n,3].

        threshold    distance of precision, recall and F-score
        min_opacity  of the Gaussians that count
        """
        given = floats(points, (None, 3), "points")
        scores = _native.splat_point_scores(struct_size=sizeof(_native.splat_point_scores))
        check(lib.splat_scene_compare_points(self.handle, min_opacity, given.ctypes.data,
                                             given.size, threshold, byref(scores)))
        return PointScores.of(scores)

    def __repr__(self) -> str:
        if self.closed:
            return "Scene(closed)"
        info = self.info
        return f"Scene({info.count} Gaussians, sh_degree {info.sh_degree})"


def _made_again(kind: Type[Scene], state: Dict[str, Any]) -> Scene:
    """A scene of a class with these attributes."""
    made = kind.__new__(kind)
    Scene.__init__(made, **state)
    return made


def _degree(terms: int) -> int:
    """The degree of so many terms of spherical harmonics."""
    degrees = {(degree + 1)**2: degree for degree in range(4)}
    if terms not in degrees:
        raise InvalidArgument(f"sh has {terms} terms, expected 1, 4, 9 or 16")
    return degrees[terms]
