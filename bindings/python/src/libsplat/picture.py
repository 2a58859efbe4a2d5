"""Pictures of objects: what a predictor sees, and how it cuts them out."""
from ctypes import byref, sizeof
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Tuple, Union

import numpy as np

from . import _native
from ._arrays import ArrayLike, ByValue, File, address, doubles, floats, image_struct, pixel_array
from ._errors import check
from ._library import lib
from ._records import PictureInfo
from ._text import flags_of, path_of
from .device import whole as whole_number
from .image import Image

# A path, the bytes of a file, an open one, or pixels: uint8, float16 or float32 [height,width,channels].
Source = Union[File, ArrayLike]


@dataclass(eq=False)
class Picture(ByValue):
    """One view of an object.

    image            what shows it; pixels and files are reduced to 8 bits
    mask             of the object; None: an alpha that is not opaque everywhere, else what differs
                     from the border
    depth, normal    maps where the network takes them; larger depth is nearer, or as
                     model.head.depth_maps says; float depths may have any scale, those of files are
                     taken as they are; normals are (normal + 1) / 2 in the camera's axes
    whole            use the largest centred square, not the object's
    foreground       the object's longer side, as a part of the square's; 0: 0.65
    focal            pixels of the image; 0: by its Exif data, else not known
    origin_distance  along the camera's axis, where the network takes it
    world_to_camera  [4,4]; networks of several views need the poses of all
    embedding        of a custom embedding; tokens [token_dim,tokens] where the network takes them
    """

    image: Source
    mask: Optional[Source] = None
    depth: Optional[Source] = None
    normal: Optional[Source] = None
    whole: bool = False
    foreground: float = 0.0
    focal: float = 0.0
    origin_distance: float = 0.0
    world_to_camera: Optional[ArrayLike] = None
    embedding: Optional[ArrayLike] = None
    tokens: Optional[ArrayLike] = None

    if not TYPE_CHECKING:  # tools find misspelt names by the fields
        def __setattr__(self, name: str, value: Any) -> None:
            if type(self) is Picture and name not in self.__dataclass_fields__:
                raise AttributeError(f"a Picture has no {name!r}, expected one of "
                                     f"{', '.join(self.__dataclass_fields__)}")
            super().__setattr__(name, value)


def _fill_source(raw: Any, source: Any, what: str, kept: List[Any]) -> float:
    """Describe an image or a map. Returns the focal length of its Exif data, pixels; 0: not known here."""
    if source is None:
        return 0.0
    if isinstance(source, str) or hasattr(source, "__fspath__"):
        raw.path = path_of(source, what)
        return 0.0
    focal = 0.0
    if isinstance(source, Image):
        focal = source.focal
    elif isinstance(source, (bytes, bytearray, memoryview)) or hasattr(source, "read"):
        loaded = Image.load(source)
        source, focal = loaded.array, loaded.focal
        if loaded.bits == 16:  # reduced to 8 as the library reduces files of 16 bits
            source = np.rint(source * 255).astype(np.uint8)
    array = pixel_array(source, what)
    kept.append(array)
    raw.pixels = image_struct(array)
    return focal


def fill_picture(raw: Any, picture: Union[Picture, Source], kept: List[Any]) -> None:
    """Describe a picture to the library; `kept` receives what must live as long."""
    if not isinstance(picture, Picture):
        picture = Picture(picture)
    focal = _fill_source(raw.image, picture.image, "image", kept)
    for name in ("mask", "depth", "normal"):
        _fill_source(getattr(raw, name), getattr(picture, name), name, kept)
    raw.flags = flags_of((picture.whole, _native.PictureFlags.WHOLE))
    raw.foreground, raw.focal = picture.foreground, picture.focal or focal
    raw.origin_distance = picture.origin_distance
    if picture.world_to_camera is not None:
        matrix = doubles(picture.world_to_camera, (4, 4), "world_to_camera")
        raw.world_to_camera[:] = matrix.ravel().tolist()
    for name, size in (("embedding", "embedding_count"), ("tokens", "token_count")):
        data = getattr(picture, name)
        if data is not None:
            kept.append(floats(data, None, name))
            setattr(raw, name, address(kept[-1]))
            setattr(raw, size, kept[-1].size)


def picture_array(pictures: Any) -> Tuple[Any, List[Any]]:
    """The library's array of one picture or a list of them, and what must live as long."""
    given = list(pictures) if isinstance(pictures, (list, tuple)) else [pictures]
    kept: List[Any] = []
    raw = (_native.splat_picture * len(given))()
    for each, picture in zip(raw, given):
        fill_picture(each, picture, kept)
    return raw, kept


def cut_picture(picture: Union[Picture, Source], resolution: int,
                background: ArrayLike = (1, 1, 1)) -> Tuple[Dict[str, Image], PictureInfo]:
    """Cut a picture and its maps out as a predictor does: squares of `resolution` pixels.

    Returns float32 images "image" and "mask", "depth" and "normal" where the picture has the map,
    and what became of the picture. Raises NotFound, FormatError, InvalidArgument.
    """
    kept: List[Any] = []
    raw, info = _native.splat_picture(), _native.splat_picture_info()
    given = picture if isinstance(picture, Picture) else Picture(picture)
    fill_picture(raw, given, kept)
    desc = _native.splat_picture_cut_desc(struct_size=sizeof(_native.splat_picture_cut_desc))
    desc.resolution = side = whole_number(resolution, "resolution")
    desc.background[:] = doubles(background, (3,), "background").tolist()
    cut: Dict[str, Any] = {}
    for name, channels in (("image", 3), ("mask", 1), ("depth", 1), ("normal", 3)):
        if name in ("image", "mask") or getattr(given, name) is not None:
            cut[name] = np.empty((side, side, channels)[:2 + (channels > 1)], np.float32)
            setattr(desc, name, image_struct(cut[name]) if side else _native.splat_image())
    check(lib.splat_picture_cut(byref(raw), byref(desc), byref(info)))
    return {name: Image(array) for name, array in cut.items()}, PictureInfo.of(info)
