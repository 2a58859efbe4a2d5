"""Parts of networks: single operators on tensors, and modules with parameters of their own."""
import threading
from ctypes import byref, c_void_p, sizeof
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _native
from ._arrays import ArrayLike, Floats, address, floats, set_dims
from ._errors import NotFound, direct
from ._handle import Handle, made
from ._library import lib
from ._text import choice, encoded, flags_of, json_from, json_of
from .device import Device, whole
from .model import Port, ports_of
from .tensor import Tensor

Attributes = Union[None, str, "dict[str, Any]"]
Tensors = Sequence[Optional[Tensor]]


def operators() -> List[Dict[str, Any]]:
    """All operators: name, inputs, outputs, attributes, equation."""
    listed: List[Dict[str, Any]] = json_from(lib.splat_op_list)
    return listed


class Op(Handle):
    """One differentiable operator, recorded on tensors whose contents may change between runs.

    type         a name of `operators`
    attributes   JSON text or a dict; None: defaults
    inputs, outputs            tensors in the operator's order; optional ones may be None
    grad_outputs, grad_inputs  tensors of their shapes, or None for no backward; gradients of inputs
                               that are None are not computed
    accumulate   add gradients of parameters to the contents of the tensors
    Raises InvalidArgument, ShapeMismatch; the message names the tensor.
    """

    __slots__ = ()
    _kind = "op"

    def __init__(self, device: Device, type: str, inputs: Tensors, outputs: Tensors, *,
                 attributes: Attributes = None, grad_outputs: Optional[Tensors] = None,
                 grad_inputs: Optional[Tensors] = None, accumulate: bool = False) -> None:
        desc = _native.splat_op_desc(struct_size=sizeof(_native.splat_op_desc))
        desc.flags = flags_of((accumulate, _native.OpFlags.ACCUMULATE))
        desc.type, desc.attributes = encoded(type, "type"), json_of(attributes, "attributes")
        desc.input_count, desc.output_count = len(inputs), len(outputs)
        for name, tensors, count in (("inputs", inputs, len(inputs)),
                                     ("outputs", outputs, len(outputs)),
                                     ("grad_outputs", grad_outputs, len(outputs)),
                                     ("grad_inputs", grad_inputs, len(inputs))):
            if tensors is not None:
                padded = [*tensors, *[None] * count][:max(count, len(tensors))]
                setattr(desc, name, (c_void_p * len(padded))(
                    *(None if each is None else each.handle for each in padded)))
        self._own(made("op", direct, lib.splat_op_create, device.handle, byref(desc)), device)

    def forward(self) -> None:
        """Compute the outputs from the inputs."""
        self._run(lib.splat_op_forward, self.handle)

    def backward(self) -> None:
        """Compute the gradients of sum(grad_outputs * outputs) at the last forward."""
        self._run(lib.splat_op_backward, self.handle)


class Module(Handle):
    """One operator, or one block of the network, with its parameters.

    type             a name of `operators`, or "residual_block"
    shapes           shapes of its inputs and parameters by name, such as {"x": (1, 8, 16, 16)}
    attributes       JSON text or a dict; None: defaults
    gradients        enable `backward`; input_gradients also computes those of inputs
    training         apply dropout in a residual_block
    precision        of a residual_block: "strict", "balanced" or "fast"
    Parameters, inputs and gradients of outputs are zero at first. Threads take turns on one module.
    Raises InvalidArgument, ShapeMismatch; the message names the port.
    """

    __slots__ = ("_shapes",)
    _kind = "module"

    def __init__(self, device: Device, type: str, shapes: Mapping[str, Sequence[int]], *,
                 attributes: Attributes = None, gradients: bool = False,
                 input_gradients: bool = False, training: bool = False,
                 precision: Union[None, int, _native.PrecisionName] = None) -> None:
        bits = _native.ModuleFlags
        ports = (_native.splat_port * len(shapes))()
        for port, (name, shape) in zip(ports, shapes.items()):
            port.name = encoded(name, "a name")
            set_dims(port, shape, f"'{name}'")
        desc = _native.splat_module_desc(struct_size=sizeof(_native.splat_module_desc))
        desc.flags = flags_of((gradients, bits.GRADIENTS), (training, bits.TRAINING),
                              (input_gradients, bits.INPUT_GRADIENTS))
        desc.type, desc.attributes = encoded(type, "type"), json_of(attributes, "attributes")
        desc.ports, desc.port_count = ports, len(ports)
        desc.precision = choice(_native.Precision, precision, "precision")
        self._own(made("module", direct, lib.splat_module_create, device.handle, byref(desc)),
                  device)
        self._lock = threading.RLock()
        self._shapes: Dict[str, Tuple[int, ...]] = {
            port.name: port.shape for kind in list(_native.PortKind) for port in self.ports(kind)}

    @property
    def report(self) -> Dict[str, Any]:
        """Type, inputs, outputs, parameters and bytes of memory."""
        found: Dict[str, Any] = json_from(lib.splat_module_report, self.handle)
        return found

    def ports(self, kind: Union[int, _native.PortKindName] = "parameter") -> List[Port]:
        """Names and shapes of inputs ("input"), outputs ("output") or parameters."""
        return ports_of(self, lib.splat_module_ports, kind)

    def init(self, seed: int = 0) -> None:
        """Initialise the parameters at random."""
        self._run(lib.splat_module_init, self.handle, whole(seed, "seed", 64))

    def _shape(self, name: str) -> Tuple[int, ...]:
        plain = name[len("grad:"):] if name.startswith("grad:") else name
        if plain not in self._shapes:
            raise NotFound(f"the module has no '{name}', expected one of "
                           f"{', '.join(self._shapes)}, or grad: and such a name")
        return self._shapes[plain]

    def write(self, name: str, values: ArrayLike) -> None:
        """Set an input, a parameter, or the gradient of the loss with respect to an output."""
        array = floats(values, self._shape(name), name)
        self._run(lib.splat_module_write, self.handle, encoded(name, "name"), address(array),
                  array.nbytes)

    def read(self, name: str) -> Floats:
        """A copy of an input, a parameter, an output ("y"), or a gradient ("grad:weight")."""
        values = np.empty(self._shape(name), np.float32)
        self._run(lib.splat_module_read, self.handle, encoded(name, "name"), address(values),
                  values.nbytes)
        return values

    def forward(self, **inputs: ArrayLike) -> None:
        """Compute the outputs, after writing the inputs that are given."""
        for name, values in inputs.items():
            self.write(name, values)
        self._run(lib.splat_module_forward, self.handle)

    def backward(self, **grad_outputs: ArrayLike) -> None:
        """Add to the gradients of parameters and overwrite those of inputs; once after `forward`.

        grad_outputs  of outputs by their names, written first
        """
        for name, values in grad_outputs.items():
            self.write(f"grad:{name}", values)
        self._run(lib.splat_module_backward, self.handle)

    def zero_gradients(self) -> None:
        """Set the gradients of parameters to zero."""
        self._run(lib.splat_module_zero_gradients, self.handle)

