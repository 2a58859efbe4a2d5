"""PyTorch: images of Gaussians and modules of the library that autograd differentiates.

    from libsplat.torch import rasterize
    drawn = rasterize(means, scales, rotations, opacities, colors, camera)
    (drawn.images - photo).square().mean().backward()

Tensors are float32 in host memory. Outputs share the memory of the device where it is unified, and
are copied elsewhere. Gradients exist once: backward of a backward pass is refused.
"""
import copy
import importlib
import threading
import weakref
from collections import OrderedDict
from typing import (TYPE_CHECKING, Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence,
                    Tuple, TypeVar, Union)

from . import _native, module as _module
from ._arrays import ArrayLike, doubles, shape_text, whole_shape
from ._errors import InvalidArgument, ShapeMismatch, Unsupported, kind_of
from ._text import checked
from .camera import Camera
from .device import Device, default_device, whole
from .rasterizer import Cameras, Output, Rasterizer, RasterState
from .tensor import Tensor

Function = TypeVar("Function", bound=Callable[..., Any])

try:
    torch: Any = importlib.import_module("torch")
    _differentiable = importlib.import_module("torch.autograd.function").once_differentiable
except ImportError as error:
    raise ImportError("libsplat.torch needs PyTorch: apt-get install python3-torch, or "
                      "python3 -m pip install torch") from error

KEPT = 4  # rasterizers that stay ready for the next call

if TYPE_CHECKING:
    from torch import Tensor as Values

if hasattr(torch.serialization, "add_safe_globals"):
    torch.serialization.add_safe_globals([Camera])  # what torch.load takes without weights_only=False


class Drawn(NamedTuple):
    """images [V,H,W,3], alpha [V,H,W], and depth [V,H,W] or None; float32 tensors."""

    images: "Values"
    alpha: "Values"
    depth: "Optional[Values]"


def once(backward: Function) -> Function:
    """A backward pass that has none of its own."""
    kept: Function = _differentiable(backward)
    return kept


def _in_host_memory(value: Any, what: str) -> None:
    if value.device.type != "cpu":
        raise InvalidArgument(f"{what} is on {value.device}, expected host memory: copy it there "
                              "with .cpu()")


def _checked(value: Any, what: str) -> Any:
    """A float32 tensor in host memory. Raises InvalidArgument for another object."""
    if not isinstance(value, torch.Tensor):
        raise InvalidArgument(f"{what} is {kind_of(value)}, expected a torch.Tensor")
    _in_host_memory(value, what)
    if value.layout != torch.strided:
        raise InvalidArgument(f"{what} has the layout {value.layout}, expected a dense tensor: "
                              "convert it with .to_dense()")
    if value.dtype != torch.float32:
        raise InvalidArgument(f"{what} has the type {value.dtype}, expected torch.float32: convert "
                              "it with .float()")
    return value


def _array(value: Any) -> Any:
    return value.detach().contiguous().numpy()


def _torch(tensor: Tensor) -> Any:
    """The elements of a new tensor of the library, without a copy where memory is unified."""
    try:
        return torch.from_numpy(tensor.array)
    except Unsupported:
        return torch.from_numpy(tensor.numpy())


class _Pool:
    """A rasterizer and its states that no graph uses."""

    __slots__ = ("rasterizer", "depth", "free")

    def __init__(self, rasterizer: Rasterizer, depth: bool) -> None:
        self.rasterizer, self.depth = rasterizer, depth
        self.free: List[RasterState] = []


class _Lease:
    """A state that goes back to its pool when the graph that holds it is freed.

    The finalizer keeps the state. With `__del__` the collector might destroy it first, with a cycle
    that holds the lease.
    """

    __slots__ = ("pool", "state", "__weakref__")

    def __init__(self, pool: _Pool) -> None:
        self.pool = pool
        try:
            self.state = pool.free.pop()
        except IndexError:
            self.state = pool.rasterizer.state()
        weakref.finalize(self, pool.free.append, self.state).atexit = False


_pools: "OrderedDict[Tuple[Any, ...], _Pool]" = OrderedDict()
_lock = threading.Lock()


def _pool(device: Device, *key: Any, **options: Any) -> _Pool:
    """The rasterizer of a size and of options; those used least recently are let go."""
    name = (device, *key, *sorted(options.items()))
    with _lock:
        for old in [each for each in _pools if each[0].closed]:
            del _pools[old]
        if name not in _pools:
            _pools[name] = _Pool(Rasterizer(device, *key, backward=True, **options),
                                 options["depth"])
        _pools.move_to_end(name)
        while len(_pools) > KEPT:
            _pools.popitem(last=False)
        return _pools[name]


def release_memory() -> None:
    """Give the memory of drawing back to the devices that no graph uses, as a later call does not.

    `rasterize` keeps what its graphs used, for the next ones of the same sizes and options.
    """
    with _lock:
        _pools.clear()


def _background(color: Any) -> Any:
    """A background: a tensor of any type of numbers, or an array. Raises InvalidArgument.

    Numbers are read here, where a list of tensors that require gradients is refused, which in
    `forward` it would not be.
    """
    if isinstance(color, torch.Tensor):
        _in_host_memory(color, "background")
        return color
    return None if color is None else doubles(color, (3,), "background")


def _numbers(color: Any) -> Any:
    """A background for the rasterizer."""
    return color.detach().double().numpy() if isinstance(color, torch.Tensor) else color


def _behind(lease: _Lease, slope: Any) -> Any:
    """The gradient at the background, whose part of a pixel is 1 - alpha; summed in float64."""
    if slope is None:
        return None
    alpha = torch.from_numpy(lease.pool.rasterizer.read("alpha", state=lease.state))
    return ((1 - alpha.double())[..., None] * slope.double()).sum((0, 1, 2))


class _Rasterize(torch.autograd.Function):  # type: ignore[misc]
    @staticmethod
    def forward(ctx: Any, pool: _Pool, cameras: Cameras, background: Any, names: Sequence[str],
                *given: Any) -> Any:
        ctx.set_materialize_grads(False)
        ctx.lease, ctx.names = _Lease(pool), names
        ctx.shapes = [each.shape for each in given]
        state = ctx.lease.state
        pool.rasterizer.forward_arrays(cameras, _numbers(background), state=state,
                                       **dict(zip(names, map(_array, given))))
        outputs = [Output.RGB, Output.ALPHA, Output.DEPTH][:3 if pool.depth else 2]
        return tuple(_torch(pool.rasterizer.output(each, state=state)) for each in outputs)

    @staticmethod
    @once
    def backward(ctx: Any, *slopes: Any) -> Any:
        wanted = [name for name, needed in zip(ctx.names, ctx.needs_input_grad[4:]) if needed]
        behind = _behind(ctx.lease, slopes[0]) if ctx.needs_input_grad[2] else None
        if not wanted or all(each is None for each in slopes) or 0 in ctx.shapes[0]:
            found = {name: torch.zeros(shape) for name, shape in zip(ctx.names, ctx.shapes)}
        else:
            arrays = {name: None if each is None else _array(each)
                      for name, each in zip(("rgb", "alpha", "depth"), slopes)}
            made = ctx.lease.pool.rasterizer.backward(wanted, state=ctx.lease.state, **arrays)
            found = {name: _torch(tensor) for name, tensor in made.items()}
        return (None, None, behind, None) + tuple(found[name] if name in wanted else None
                                                  for name in ctx.names)


def _not_compiled(function: Function) -> Function:
    """The function, which torch.compile is to call as it is; before PyTorch 2.1 it stays alone."""
    disable = getattr(getattr(torch, "compiler", None), "disable", None)
    kept: Function = function if disable is None else disable(function)
    return kept


@_not_compiled
@checked
def rasterize(means: "Values", scales: "Values", rotations: "Values", opacities: "Values", colors: "Values",
              cameras: Union[Camera, Sequence[Camera]], background: Optional[ArrayLike] = None, *,
              convention: Union[int, _native.ConventionName] = "3dgs", antialiased: bool = False,
              sh_degree: Optional[int] = None, depth: bool = False,
              device: Optional[Device] = None) -> Drawn:
    """Draw Gaussians; gradients flow to every tensor that requires them.

    means [n,3], scales [n,3] (standard deviations), rotations [n,4] w, x, y, z, opacities [n];
    the convention "3dgs" expects rotations of length 1
    colors      RGB [n,3], or spherical harmonics [n,K,3], of which sh_degree uses (degree + 1)^2
    background  RGB, also a tensor that requires a gradient; None: black
    Forward passes stay alive until their graphs are freed; backward passes come in any order. A
    function that torch.compile compiles calls this one between two graphs.
    Raises InvalidArgument (type, device), ShapeMismatch, Cancelled.
    """
    names = ["means", "scales", "rotations", "opacities", "colors"]
    given = [_checked(value, name) for value, name in
             zip((means, scales, rotations, opacities, colors), names)]
    views = [cameras] if isinstance(cameras, Camera) else list(cameras)
    if not views or not isinstance(views[0], Camera):
        raise InvalidArgument("cameras has no Camera, expected one or more")
    background = _background(background)
    direct, degree = colors.dim() == 2, 0
    if direct and sh_degree is not None:
        raise InvalidArgument(f"sh_degree is {sh_degree!r}, but colors is RGB, which has no degree: "
                              "give spherical harmonics [n,K,3], or leave sh_degree out")
    if not direct:
        terms = colors.shape[1] if colors.dim() == 3 else 0
        degree = int(terms**0.5) - 1 if sh_degree is None else whole(sh_degree, "sh_degree")
        if degree not in range(4) or (degree + 1)**2 > terms or (
                sh_degree is None and (degree + 1)**2 != terms):
            raise ShapeMismatch(f"colors has the shape {list(colors.shape)}, expected [n,3], or "
                                "[n,K,3] with K = (sh_degree + 1)^2 and a degree of 0 to 3")
        given[4], names[4] = colors[:, :(degree + 1)**2], "sh"
    if means.dim() != 2 or means.shape[1] != 3:
        raise ShapeMismatch(f"means has the shape {list(means.shape)}, expected [n,3]")
    capacity = 1 << max(int(means.shape[0]) - 1, 255).bit_length()
    pool = _pool(default_device() if device is None else device, capacity, views[0].width,
                 views[0].height, views=len(views), sh_degree=degree, direct_colors=direct,
                 antialiased=antialiased, convention=convention, depth=depth, grad_depth=depth)
    drawn = _Rasterize.apply(pool, views, background, names, *given)
    return Drawn(drawn[0], drawn[1], drawn[2] if depth else None)


class _Apply(torch.autograd.Function):  # type: ignore[misc]
    @staticmethod
    def forward(ctx: Any, owner: Any, names: Sequence[str], *given: Any) -> Any:
        ctx.owner, ctx.names = owner, names
        ctx.save_for_backward(*given)
        with owner.turn:
            ctx.ticket = owner._compute(names, given)
            return tuple(torch.from_numpy(owner.native.read(each)) for each in owner.outputs)

    @staticmethod
    @once
    def backward(ctx: Any, *slopes: Any) -> Any:
        owner = ctx.owner
        with owner.turn:
            if ctx.ticket != owner.ticket:  # another forward pass has replaced what it needs
                owner._compute(ctx.names, ctx.saved_tensors)
            owner.ticket += 1
            owner.native.zero_gradients()
            owner.native.backward(**dict(zip(owner.outputs, map(_array, slopes))))
            return (None, None) + tuple(
                torch.from_numpy(owner.native.read(f"grad:{name}")) if needed else None
                for name, needed in zip(ctx.names, ctx.needs_input_grad[2:]))


class Module(torch.nn.Module):  # type: ignore[misc]
    """A `splat.Module` as a torch.nn.Module: one operator or block, with its parameters.

    type, shapes, attributes, options  as for `splat.Module`; seed of the initial parameters
    Parameters have the library's names, with _ for each dot. Call it with the inputs in the order
    of `inputs`, or by name; it gives the output, or a tuple of several. Copies stay on the device;
    what torch.load reads is on the default one.
    Raises InvalidArgument (type, device, no such input), ShapeMismatch.
    """

    def __init__(self, type: str, shapes: Mapping[str, Sequence[int]], *,
                 attributes: _module.Attributes = None, seed: int = 0,
                 device: Optional[Device] = None, **options: Any) -> None:
        super().__init__()
        self._begin({"type": type, "shapes": {name: whole_shape(shape, f"'{name}'")
                                              for name, shape in shapes.items()},
                     "attributes": copy.deepcopy(attributes), **options}, device)
        self.native.init(seed)
        self.inputs = [port.name for port in self.native.ports("input")]
        self.outputs = [port.name for port in self.native.ports("output")]
        self.names = [port.name for port in self.native.ports()]
        for name in self.names:
            self.register_parameter(name.replace(".", "_"), torch.nn.Parameter(
                torch.from_numpy(self.native.read(name))))

    def _begin(self, made_of: Dict[str, Any], device: Optional[Device]) -> None:
        """Make the part that is not in a state."""
        self.made_of, self.turn, self.ticket = made_of, threading.RLock(), 0
        self.native = _module.Module(default_device() if device is None else device, gradients=True,
                                     input_gradients=True, **made_of)

    def __getstate__(self) -> Dict[str, Any]:
        state: Dict[str, Any] = self.__dict__.copy()
        for name in ("native", "turn", "ticket"):
            del state[name]
        return state

    def __setstate__(self, state: Dict[str, Any]) -> None:
        super().__setstate__(state)
        self._begin(self.made_of, None)

    def __copy__(self) -> "Module":
        return self._copied(self.__getstate__())

    def __deepcopy__(self, memo: Dict[int, Any]) -> "Module":
        made = memo[id(self)] = self._copied(copy.deepcopy(self.__getstate__(), memo))
        return made

    def _copied(self, state: Dict[str, Any]) -> "Module":
        """One of this state on the same device."""
        made: Module = self.__class__.__new__(self.__class__)
        super(Module, made).__setstate__(state)
        made._begin(made.made_of, self.native._device)
        return made

    def extra_repr(self) -> str:
        """What the repr says: the type, and the shapes of inputs and parameters."""
        shapes = (f"{name}={shape_text(shape)}" for name, shape in self.made_of["shapes"].items())
        return ", ".join([repr(self.made_of["type"]), *shapes])

    def _compute(self, names: Sequence[str], given: Sequence[Any]) -> int:
        self.native.forward(**dict(zip(names, map(_array, given))))
        self.ticket += 1
        return self.ticket

    if TYPE_CHECKING:
        def __call__(self, *values: Values, **named: Values) -> Values:
            """The output; several are a tuple, which the type does not tell."""
            raise NotImplementedError

    def forward(self, *values: Any, **named: Any) -> Any:
        """The outputs at these inputs and the present parameters."""
        given = {**dict(zip(self.inputs, values)), **named}
        if len(values) + len(named) != len(given) or set(given) != set(self.inputs):
            raise InvalidArgument(f"inputs are {', '.join(given) or 'none'}, expected each of "
                                  f"{', '.join(self.inputs)} once")
        for name in self.names:
            given[name] = getattr(self, name.replace(".", "_"))
        for name, value in given.items():
            _checked(value, name)
        results = _Apply.apply(self, list(given), *given.values())
        return results[0] if len(results) == 1 else results


setattr(Module, "__init__", checked(Module.__init__, "Module"))
