"""Writing a small ONNX graph by hand. Knows nothing of the models."""
import hashlib

import numpy as np
from onnx import TensorProto, helper

OPSET, IR_VERSION = 18, 9  # old enough for every ONNX Runtime that the program may find
DTYPES = {
    "f32": TensorProto.FLOAT,
    "f16": TensorProto.FLOAT16,
    "bf16": TensorProto.BFLOAT16,
    "i64": TensorProto.INT64,
    "i32": TensorProto.INT32,
    "bool": TensorProto.BOOL,
}


class Graph:
    """Nodes in the order in which they are called; every value is named by a number, so bytes repeat."""

    def __init__(self):
        self.nodes, self.weights, self.inputs, self.outputs = [], [], [], []
        self.count = 0

    def fresh(self, hint):
        self.count += 1
        return f"{hint}_{self.count}"

    def input(self, name, dtype, shape):
        """A named input; strings in `shape` are symbolic."""
        self.inputs.append(helper.make_tensor_value_info(name, DTYPES[dtype], shape))
        return name

    def output(self, value, name, dtype, shape):
        """Casts `value` to `dtype` and calls it `name`."""
        self.nodes.append(helper.make_node("Cast", [value], [name], to=DTYPES[dtype]))
        self.outputs.append(helper.make_tensor_value_info(name, DTYPES[dtype], shape))

    def op(self, kind, *values, **attributes):
        name = self.fresh(kind)
        self.nodes.append(helper.make_node(kind, list(values), [name], **attributes))
        return name

    def weight(self, array, hint="w"):
        """An initializer: float arrays as f32, integers as i64."""
        array = np.asarray(array)
        kind = "i64" if array.dtype.kind == "i" else "f32"
        array = array.astype("<i8" if kind == "i64" else "<f4")
        name = self.fresh(hint)
        tensor = helper.make_tensor(name, DTYPES[kind], array.shape, array.tobytes(), raw=True)
        self.weights.append(tensor)
        return name

    def ints(self, *values):
        return self.weight(np.array(values, dtype=np.int64), "i")

    def f32(self, value):
        return self.op("Cast", value, to=TensorProto.FLOAT)

    def add(self, *values):
        total = values[0]
        for value in values[1:]:
            total = self.op("Add", total, value)
        return total

    def dims(self, value):
        """The lengths of the axes, each as an i64 tensor of shape [1]."""
        shape = self.op("Shape", value)
        return lambda axis: self.op("Slice", shape, self.ints(axis), self.ints(axis + 1))

    def reshape(self, value, *dims):
        """Reshape to lengths that are integers or tensors of shape [1]."""
        parts = [self.ints(d) if isinstance(d, int) else d for d in dims]
        return self.op("Reshape", value, self.op("Concat", *parts, axis=0))

    def roll(self, value, axis):
        """numpy's roll by one along `axis`."""
        far = np.iinfo(np.int64).max
        last = self.op("Slice", value, self.ints(-1), self.ints(far), self.ints(axis))
        rest = self.op("Slice", value, self.ints(0), self.ints(-1), self.ints(axis))
        return self.op("Concat", last, rest, axis=axis)

    def save(self, path, external=False):
        """Writes the model; with `external`, float weights go to NAME.data beside it. Returns {file name: sha256}."""
        data = b""
        if external:
            for tensor in self.weights:
                if tensor.data_type != TensorProto.FLOAT:
                    continue  # shapes must be readable without the data
                raw = tensor.raw_data
                tensor.ClearField("raw_data")
                tensor.data_location = TensorProto.EXTERNAL
                for key, value in (("location", path.name + ".data"), ("offset", len(data)), ("length", len(raw))):
                    entry = tensor.external_data.add()
                    entry.key, entry.value = key, str(value)
                data += raw
        graph = helper.make_graph(self.nodes, "contract", self.inputs, self.outputs, self.weights)
        model = helper.make_model(
            graph,
            opset_imports=[helper.make_opsetid("", OPSET)],
            ir_version=IR_VERSION,
            producer_name="physvideo-engine",
        )
        files = {path.name: model.SerializeToString(deterministic=True)}
        if external:
            files[path.name + ".data"] = data
        for name, content in files.items():
            (path.parent / name).write_bytes(content)
        return {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
