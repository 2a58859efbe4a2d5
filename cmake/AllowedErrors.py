"""AllowedErrors.py MODULE: lets quotients, roots and exponentials of a SPIR-V module err by what Vulkan allows, at
random by the bits of the operands. Rewrites the file. The table is that of tests/ref/rounded.h.

A result moves by whole units of its last place: by at most `flat` plus `slope` times the operand's magnitude, which is
what the table allows, less lavapipe's own error. Logarithms of [0.5, 2] move by up to 2^-21. Results near the ends of
the range of exponents are left alone, and those of up to 8 bits, such as 1 / 1, which devices find exactly. Out of its
reach: fused and reordered sums of products, flushed denormals, and constants that the compiler folds."""
import re
import subprocess
import sys

# A quotient is within 2.5 units, of which half a one is lavapipe's; exp is within 3 + 2 |x|, of which lavapipe's product
# with log2(e) takes 1.2 |x|.
BOUNDS = {"OpFDiv": (2, 0), "Exp": (2, 0.75), "Exp2": (2, 2), "Sqrt": (4, 0), "InverseSqrt": (1, 0), "Length": (4, 0),
          "Normalize": (1, 0), "Log": (2, 0), "Log2": (2, 0)}
RESULT = re.compile(r"\s*(%\w+) = (?:(OpFDiv) (%\w+) (%\w+) (%\w+)|OpExtInst (%\w+) %\w+ (\w+) (%\w+))$")


class Globals:
    """Types and constants of the module, and those that are added."""

    def __init__(self, lines):
        self.ids = {}
        for line in lines:
            match = re.match(r"\s*(%\w+) = (OpType(?:Float|Int|Bool|Vector)\b.*|OpConstant \S+ \S+)$", line)
            if match:
                self.ids.setdefault(match[2].strip(), match[1])
        self.types = {name: text for text, name in self.ids.items()}
        self.added = []

    def get(self, text):
        if text not in self.ids:
            self.ids[text] = f"%new_{len(self.added)}"
            self.added.append(f"{self.ids[text]} = {text}")
        return self.ids[text]

    def vector(self, scalar, size):
        return scalar if size == 1 else self.get(f"OpTypeVector {scalar} {size}")

    def constant(self, scalar, size, value):
        one = self.get(f"OpConstant {scalar} {value}")
        if size == 1:
            return one
        return self.get(f"OpConstantComposite {self.vector(scalar, size)}" + f" {one}" * size)


def erring(module, result, kind, of, exact, operands, library):
    """Lines that set `result` to `exact`, moved."""
    float32, uint32 = module.get("OpTypeFloat 32"), module.get("OpTypeInt 32 0")
    size = 1 if of == float32 else int(module.types[of].split()[2])
    uints = module.vector(uint32, size)
    lines = []

    def emit(text):
        lines.append(f"{result}_{len(lines)} = {text}")
        return f"{result}_{len(lines) - 1}"

    def uint(value):
        return module.constant(uint32, size, value)

    def real(value):
        return module.constant(float32, size, value)

    bits = emit(f"OpBitcast {uints} {exact}")
    hashed = bits
    for operand in operands:
        word = emit(f"OpBitcast {uints} {operand}")
        hashed = emit(f"OpBitwiseXor {uints} {emit(f'OpIMul {uints} {hashed} {uint(2654435761)}')} {word}")
    hashed = emit(f"OpIMul {uints} {hashed} {uint(2246822519)}")
    high = emit(f"OpShiftRightLogical {uints} {hashed} {uint(15)}")
    hashed = emit(f"OpIMul {uints} {emit(f'OpBitwiseXor {uints} {hashed} {high}')} {uint(3266489917)}")
    hashed = emit(f"OpShiftRightLogical {uints} {hashed} {uint(9)}")
    unit = emit(f"OpFMul {of} {emit(f'OpConvertUToF {of} {hashed}')} {real(2.0 ** -22)}")
    unit = emit(f"OpFSub {of} {unit} {real(1 - 2.0 ** -23)}")  # within (-1, 1)
    flat, slope = BOUNDS[kind]
    bound = real(flat + 1)
    if slope:
        magnitude = emit(f"OpExtInst {of} {library} FAbs {operands[0]}")
        bound = emit(f"OpFAdd {of} {emit(f'OpFMul {of} {magnitude} {real(slope)}')} {bound}")
        bound = emit(f"OpExtInst {of} {library} Floor {bound}")
    units = emit(f"OpConvertFToS {uints} {emit(f'OpFMul {of} {unit} {bound}')}")
    moved = emit(f"OpIAdd {uints} {bits} {units}")
    bools = module.vector(module.get("OpTypeBool"), size)
    if kind in ("Log", "Log2"):
        near = emit(f"OpFAdd {of} {exact} {emit(f'OpFMul {of} {unit} {real(0.9 * 2.0 ** -21)}')}")
        low = emit(f"OpFOrdGreaterThanEqual {bools} {operands[0]} {real(0.5)}")
        both = emit(f"OpLogicalAnd {bools} {low} {emit(f'OpFOrdLessThanEqual {bools} {operands[0]} {real(2)}')}")
        moved = emit(f"OpSelect {uints} {both} {emit(f'OpBitcast {uints} {near}')} {moved}")
    exponent = emit(f"OpBitwiseAnd {uints} {bits} {uint(0x7F800000)}")
    above = emit(f"OpISub {uints} {exponent} {uint(0x08000000)}")
    inner = emit(f"OpULessThan {bools} {above} {uint(0x70000000)}")
    long = emit(f"OpINotEqual {bools} {emit(f'OpBitwiseAnd {uints} {bits} {uint(0xFFFF)}')} {uint(0)}")
    chosen = emit(f"OpSelect {uints} {emit(f'OpLogicalAnd {bools} {inner} {long}')} {moved} {bits}")
    return lines + [f"{result} = OpBitcast {of} {chosen}"]


def alter(text):
    lines = text.splitlines()
    module = Globals(lines)
    library = next((line.split()[0] for line in lines if "OpExtInstImport" in line), "")
    out, moved = [], set()
    for line in lines:
        match = RESULT.match(line)
        kind = match and (match[2] or match[7])
        if kind not in BOUNDS:
            out.append(line)
            continue
        of = match[3] or match[6]
        exact = match[1] + "_exact"
        moved.add(match[1])
        out.append(line.replace(match[1] + " =", exact + " =", 1))
        operands = [match[4], match[5]] if kind == "OpFDiv" else [] if kind == "Length" else [match[8]]
        out += erring(module, match[1], kind, of, exact, operands, library)
    for i, line in enumerate(out):
        match = re.match(r"\s*OpDecorate (%\w+) NoContraction$", line)
        if match and match[1] in moved:
            out[i] = f"OpDecorate {match[1]}_exact NoContraction"
    first = next(i for i, line in enumerate(out) if " = OpFunction " in line)
    return "\n".join(out[:first] + module.added + out[first:]) + "\n"


def main():
    path = sys.argv[1]
    text = subprocess.run(["spirv-dis", "--raw-id", path], check=True, capture_output=True, text=True).stdout
    subprocess.run(["spirv-as", "--target-env", "vulkan1.2", "-o", path, "-"], check=True, input=alter(text), text=True)


main()
