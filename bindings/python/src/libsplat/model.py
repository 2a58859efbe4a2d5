"""Networks from images to Gaussians, with their parameters on a device."""
import threading
from ctypes import byref, c_uint32, sizeof
from typing import Any, Callable, Dict, List, Optional, Tuple, Union

import numpy as np

from . import _native
from ._arrays import ArrayLike, Floats, address, floats, set_arrays, shape_text
from ._errors import NotFound, ShapeMismatch, check, direct
from ._handle import Handle, made
from ._library import lib
from ._records import ModelInfo
from ._text import choice, encoded, flags_of, json_from, json_of
from .device import Device, default_device, whole
from .scene import Scene
from .tensor import Tensor
from .weights import Weights

Config = Union[None, str, "dict[str, Any]"]


class Port:
    """A named tensor of a model or a module: name, shape, optional, trainable, gradient."""

    __slots__ = ("name", "shape", "optional", "trainable", "gradient", "__weakref__")

    def __init__(self, raw: _native.splat_port) -> None:
        self.name: str = raw.name.decode()
        self.shape: Tuple[int, ...] = tuple(raw.dims[:raw.rank])
        self.optional = bool(raw.flags & _native.PortFlags.OPTIONAL)
        self.trainable = bool(raw.flags & _native.PortFlags.TRAINABLE)
        self.gradient = bool(raw.flags & _native.PortFlags.GRADIENT)

    def __repr__(self) -> str:
        return f"Port({self.name!r}, {shape_text(self.shape)})"


def ports_of(owner: Handle, function: Callable[..., int], kind: Union[int, _native.PortKindName]) -> List[Port]:
    """The ports of a model or a module that a function lists."""
    code = choice(_native.PortKind, kind, "kind")
    count = c_uint32()
    with owner._lent() as kept:
        owner._call(function, kept.handle, code, None, 0, byref(count))
        raw = (_native.splat_port * count.value)()
        owner._call(function, kept.handle, code, raw, count.value, byref(count))
        return [Port(each) for each in raw]


class Model(Handle):
    """A network from images to Gaussians (Splatter Image with priors, embeddings and adapters).

    device           None: the default device
    config           text (JSON or YAML) or a dict; None: the published cars model
    objects          of a batch
    gradients        enable `backward`; recompute takes less memory for it and more time;
                     input_gradients also computes those of images, embedding and tokens
    training         apply dropout
    low_memory       prepare weights anew in every pass
    precision        "strict", "balanced" or "fast"
    Parameters are zero until `init` or `load`. Threads take turns on one model.
    """

    __slots__ = ()
    _kind = "model"

    def __init__(self, device: Optional[Device] = None, config: Config = None, *, objects: int = 1,
                 gradients: bool = False, input_gradients: bool = False, recompute: bool = False,
                 training: bool = False, low_memory: bool = False,
                 precision: Union[None, int, _native.PrecisionName] = None) -> None:
        device = default_device() if device is None else device
        bits = _native.ModelFlags
        desc = _native.splat_model_desc(struct_size=sizeof(_native.splat_model_desc))
        desc.flags = flags_of((gradients, bits.GRADIENTS), (training, bits.TRAINING),
                              (low_memory, bits.LOW_MEMORY), (recompute, bits.RECOMPUTE),
                              (input_gradients, bits.INPUT_GRADIENTS))
        desc.config = json_of(config, "config")
        desc.objects = whole(objects, "objects")
        desc.precision = choice(_native.Precision, precision, "precision")
        self._own(made("model", direct, lib.splat_model_create, device.handle, byref(desc)),
                  device)
        self._begin()

    def _begin(self) -> None:
        self._lock = threading.RLock()

    @property
    def device(self) -> Device:
        """Where the parameters are."""
        assert self._device is not None
        return self._device

    def init(self, seed: int = 0) -> None:
        """Initialise the parameters at random, as the published code does."""
        self._run(lib.splat_model_init, self.handle, whole(seed, "seed", 64))

    def load(self, weights: Weights, *, graft: bool = False, take_rays: bool = False,
             from_depth: bool = False, from_normal: bool = False, from_mask: bool = False,
             from_plane: bool = False, adapters: bool = False) -> None:
        """Load the parameters of a state dict, all or none.

        graft      widen the first convolution, and ignore tensors that the model lacks; from_depth,
                   from_normal, from_mask, from_plane: channels after RGB that the file's network had
        take_rays  use the file's field of view
        adapters   the file has only adapters; other parameters stay
        Raises ShapeMismatch, InvalidArgument, InvalidState; the message names the tensor.
        """
        bits = _native.LoadFlags
        flags = flags_of((graft, bits.GRAFT), (take_rays, bits.TAKE_RAYS),
                         (from_depth, bits.FROM_DEPTH), (from_normal, bits.FROM_NORMAL),
                         (from_mask, bits.FROM_MASK), (from_plane, bits.FROM_PLANE),
                         (adapters, bits.ADAPTERS))
        self._run(lib.splat_model_load, self.handle, weights.handle, flags)

    def store(self) -> Weights:
        """The parameters as a state dict, with the buffers of published files."""
        return Weights._of(made("weights", self._run, lib.splat_model_store, self.handle))

    def export(self, what: Union[int, _native.ExportName]) -> Weights:
        """Only the adapters ("adapters"), or the state dict with them folded in ("merged")."""
        return Weights._of(made("weights", self._run, lib.splat_model_export, self.handle,
                                choice(_native.Export, what, "what")))

    @property
    def info(self) -> ModelInfo:
        """What the model was made for, and what its latest pass gave."""
        info = _native.splat_model_info(struct_size=sizeof(_native.splat_model_info))
        check(lib.splat_model_get_info(self.handle, byref(info)))
        return ModelInfo.of(info)

    @property
    def report(self) -> Dict[str, Any]:
        """Parameters, memory, shapes, what the last load did, and the whole configuration."""
        found: Dict[str, Any] = json_from(lib.splat_model_report, self.handle)
        return found

    def ports(self, kind: Union[int, _native.PortKindName] = "parameter") -> List[Port]:
        """Names and shapes of inputs ("input"), outputs ("output") or parameters."""
        return ports_of(self, lib.splat_model_ports, kind)

    def tensor(self, name: str) -> Tensor:
        """A tensor that shares the model's memory: an input, output, parameter, or "grad:" of one.

        "means[1]" is the part of object 1 of an output or its gradient, in the shape that a
        rasterizer takes. Raises NotFound, InvalidState (no such gradient is computed).
        """
        return Tensor._of(made("tensor", self._call, lib.splat_model_tensor, self.handle,
                               encoded(name, "name")), self._device)

    def forward(self, images: Optional[ArrayLike] = None, *,
                view_to_world: Optional[ArrayLike] = None, quaternions: Optional[ArrayLike] = None,
                focals: Optional[ArrayLike] = None, embedding: Optional[ArrayLike] = None,
                tokens: Optional[ArrayLike] = None, seed: int = 0, step: int = 0) -> None:
        """Run the network on N = objects * views images.

        images         [N,channels,R,R] RGB 0 to 1, depth, normal, mask, planes, origin distance; None: take
                       all inputs from the tensors of the model
        view_to_world  [N,4,4] row vectors: p_world = p_view M; None: the identity
        quaternions    [N,4] w, x, y, z of that rotation
        focals [N,2] pixels, embedding [N,length], tokens [N,token_dim,tokens]: where it takes them
        seed, step     of dropout
        Raises ShapeMismatch, InvalidArgument, Cancelled.
        """
        raw = _native.splat_model_input(struct_size=sizeof(_native.splat_model_input))
        raw.seed, raw.step = whole(seed, "seed", 64), whole(step, "step")
        kept = set_arrays(raw, images=images, view_to_world=view_to_world, quaternions=quaternions,
                          focals=focals, embedding=embedding, tokens=tokens)
        if images is None:
            raw.flags = int(_native.PassFlags.TENSORS)
        elif kept[0].ndim != 4:
            raise ShapeMismatch(f"images has the shape {shape_text(kept[0].shape)}, expected "
                                "[N,channels,R,R]")
        else:
            raw.channels = kept[0].shape[1]
        self._run(lib.splat_model_forward, self.handle, byref(raw))

    def backward(self, *, means: Optional[ArrayLike] = None, opacities: Optional[ArrayLike] = None,
                 scales: Optional[ArrayLike] = None, rotations: Optional[ArrayLike] = None,
                 sh: Optional[ArrayLike] = None) -> None:
        """Add the gradients of a loss to those of the parameters; once after each `forward`.

        Arrays are gradients of the loss with respect to outputs, in their shapes; None: zeros. With
        no array at all they are taken from the tensors "grad:means" and so on.
        Raises InvalidState (made without gradients, no pass), ShapeMismatch, Cancelled.
        """
        raw = _native.splat_model_gradients(struct_size=sizeof(_native.splat_model_gradients))
        kept = set_arrays(raw, means=means, opacities=opacities, scales=scales, rotations=rotations,
                          sh=sh)
        if not kept:
            raw.flags = int(_native.PassFlags.TENSORS)
        self._run(lib.splat_model_backward, self.handle, byref(raw))

    def zero_gradients(self) -> None:
        """Set the gradients of all parameters to zero."""
        self._run(lib.splat_model_zero_gradients, self.handle)

    def read(self, name: str) -> Floats:
        """A copy of a tensor of the model: "means" [objects,M,3], "opacities" [objects,M,1],
        "scales", "rotations", "sh" [objects,M,K,3], "raw", an input, parameter, or gradient."""
        with self.tensor(name) as tensor:
            values = np.empty(tensor.shape, np.float32)
        self._run(lib.splat_model_read, self.handle, encoded(name, "name"), address(values),
                  values.nbytes)
        return values

    def write(self, name: str, values: ArrayLike) -> None:
        """Set a parameter. Raises NotFound, ShapeMismatch, InvalidArgument (not finite)."""
        shapes = {port.name: port.shape for port in self.ports()}
        if name not in shapes:
            raise NotFound(f"the model has no parameter '{name}'; see ports()")
        array = floats(values, shapes[name], name)
        self._run(lib.splat_model_write, self.handle, encoded(name, "name"), address(array),
                  array.nbytes)

    def scene(self, index: int = 0) -> Scene:
        """The Gaussians of one object of the latest pass, as a new scene."""
        return Scene._of(made("scene", self._run, lib.splat_model_scene, self.handle,
                              whole(index, "index")))

    def __repr__(self) -> str:
        if self.closed:
            return "Model(closed)"
        info = self.info
        return f"Model({info.parameters} parameters, {info.gaussians} Gaussians)"
