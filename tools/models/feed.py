"""Runs a model by its manifest with ONNX Runtime, the way the program does, to check the written graphs.

A second reader of the manifest: it knows no model, only the keys.
"""
import numpy as np

from facts import rounded
from graph import DTYPES


def to_layout(x, layout):
    """Canonical [C,T,h,w] to the tensor, with batch axis."""
    if layout == "BNC":
        return x.reshape(x.shape[0], -1).T[None]
    return (x if layout == "BCTHW" else x.swapaxes(0, 1))[None]


def from_layout(x, layout, shape):
    """The tensor back to canonical [C,T,h,w]."""
    if layout == "BNC":
        return x[0].T.reshape(shape)
    return x[0] if layout == "BCTHW" else x[0].swapaxes(0, 1)


class Session:
    """The graphs of a role, fed by name."""

    def __init__(self, runtime, folder, role):
        self.runtime = runtime
        options = runtime.SessionOptions()
        options.log_severity_level = 4  # mistakes made on purpose are refused loudly
        options.intra_op_num_threads = 1
        provider = ["CPUExecutionProvider"]
        self.sessions = [runtime.InferenceSession(folder / g["file"], options, providers=provider) for g in role["graphs"]]

    def run(self, tensors, output):
        """tensors {name: (array, dtype)} to the array called `output`."""
        values = {name: self.value(np.asarray(array, order="C"), dtype) for name, (array, dtype) in tensors.items()}
        for session in self.sessions:
            names = [o.name for o in session.get_outputs()]
            feeds = {i.name: values[i.name] for i in session.get_inputs()}
            values.update(zip(names, session.run_with_ort_values(names, feeds)))
        return values[output].numpy().astype(np.float64)

    def value(self, array, dtype):
        make = self.runtime.OrtValue
        if dtype == "bf16":
            bits = (array.astype("<f4").view("<u4") >> 16).astype("<u2")  # rounded before, so that nothing is cut off
            return make.ortvalue_from_numpy_with_onnx_type(bits, DTYPES["bf16"])
        kinds = {"f32": "<f4", "f16": "<f2", "i64": "<i8", "i32": "<i4", "bool": "|b1"}
        return make.ortvalue_from_numpy(array.astype(kinds[dtype]))


def convert(array, dtype):
    """Canonical values to what `dtype` holds: floats rounded to nearest even, integers cut towards zero."""
    if dtype in ("i64", "i32"):
        return np.trunc(np.asarray(array, dtype=np.float64))
    return np.asarray(array) != 0 if dtype == "bool" else rounded(array, dtype)


class Feeder:
    def __init__(self, manifest, sample, embeddings):
        self.m, self.s, self.embeddings = manifest, sample, embeddings
        chunk = manifest["chunk"]
        self.forward = chunk["direction"] == "forward"
        self.slots = slots = chunk["history"]
        if slots:
            filled = [sample["image"]] if chunk.get("history_includes_first") else []
            filled = np.concatenate(filled + [sample["history"]], axis=1)
            empty = np.zeros((filled.shape[0], max(0, slots - filled.shape[1]), *filled.shape[2:]))
            both = [empty, filled] if self.forward else [filled, empty]
            both = np.concatenate(both, axis=1)
            self.history = both[:, -slots:] if self.forward else both[:, :slots]

    def range(self, part):
        """The slots of a history part: first and one past the last."""
        nearest, count = part.get("nearest", 0), part.get("count", self.slots)
        return (self.slots - nearest - count, self.slots - nearest) if self.forward else (nearest, nearest + count)

    def part(self, part, item, scale):
        """One latent-shaped source, [C,T,h,w]."""
        z, image = self.s["z"], self.s["image"]
        name = part if isinstance(part, str) else part["source"]
        if name == "latents":
            return z * scale
        if name == "first":
            return image
        if name == "history":
            begin, end = self.range(part)
            return self.history[:, begin:end]
        if name == "mask":
            mask = np.zeros((item["mask_channels"], *z.shape[1:]))
            mask[:, 0] = 1.0
            return mask
        assert name == "image", name
        if item.get("image_fill", "zeros") == "encoded_grey":
            frames = self.m["latent"]["temporal"] * (z.shape[1] - 1)
            grey = np.full((3, frames, *self.s["image_frame"].shape[2:]), 0.5)
            return self.s["encode"](np.concatenate([self.s["image_frame"], grey], axis=1))
        padded = np.zeros(z.shape)
        padded[:, :1] = image
        return padded

    def indices(self, part):
        name = part if isinstance(part, str) else part["source"]
        length, padding = self.s["z"].shape[1], self.s["padding"]
        latents, history = (1 + self.slots, 1) if self.forward else (1 + padding, 1 + padding + length)
        if name == "first":
            return np.arange(1)
        if name == "latents":
            return latents + np.arange(length)
        return history + np.arange(*self.range(part))

    def number(self, item, value):
        """A number, a list by batch, or by token."""
        value = value * item.get("scale", 1.0)
        per = item.get("per", "batch")
        if per == "token":
            (_, h, w), (_, py, px) = self.s["z"].shape[1:], item["patch"]
            grid = np.full((self.s["z"].shape[1], h // py, w // px), value)
            if self.m["latent"]["first"] == "clamped":
                grid[0] = 0.0
            return grid.reshape(1, -1)
        return np.array(value) if per == "scalar" else np.array([value])

    def tensors(self, sigma, scale, table):
        """All inputs of one evaluation; `scale`: the adapter's factor on z, `table`: noise levels of integer timesteps."""
        result = {}
        for item in self.m["velocity"]["inputs"]:
            source = item.get("source")
            if "parts" in item or source in ("latents", "first", "history", "image", "mask"):
                parts = [self.part(p, item, scale) for p in item.get("parts", [item])]
                array = np.concatenate(parts, axis=1 if item.get("over") == "time" else 0)
                array = to_layout(array, item["layout"])
            elif source == "indices":
                array = np.concatenate([self.indices(p) for p in item["of"]])[None]
            elif source == "embedding":
                array = self.embeddings[item["key"]]
            elif source == "constant":
                array = np.array(item["value"]).reshape(item["shape"])
            else:
                shape = dict(zip(("frames", "height", "width"), self.s["z"].shape[1:]))
                level = {"sigma": lambda: sigma, "guidance": lambda: self.s["guidance"]}
                level["timestep"] = lambda: int(np.argmin(np.abs(table - sigma)))
                array = self.number(item, shape[source] if source in shape else level[source]())
            result[item["name"]] = (convert(array, item["dtype"]), item["dtype"])
        return result


def mistakes(tensors):
    """Yields (what, tensors) with one input wrong: scaled by a tenth, moved by 1, a token masked, an axis reversed."""
    for name, (array, dtype) in tensors.items():
        array = np.asarray(array)
        wrong = {}
        if dtype == "bool":
            wrong["masked"] = array & (np.cumsum(array, axis=-1) < array.sum())
        elif dtype in ("i64", "i32"):
            wrong["moved"] = array + 1
        else:
            wrong["scaled"] = rounded(array * 1.1, dtype)
        for axis in range(1, array.ndim):
            if (array != np.flip(array, axis)).any():
                wrong[f"axis {axis} reversed"] = np.flip(array, axis)
        for what, other in wrong.items():
            yield f"{name} {what}", {**tensors, name: (other, dtype)}


def coefficients(prediction, sigma):
    """v = p * prediction + l * z; the network gets i * z."""
    if prediction == "vp_v":
        n = np.hypot(1.0 - sigma, sigma)
        a, b = (1.0 - sigma) / n, sigma / n
        return -(a + b), (a - b) / n, 1.0 / n
    return {"eps_minus_x0": -1.0, "x0_minus_eps": 1.0}[prediction], 0.0, 1.0


def vp_table(vp):
    """Noise level of each integer timestep of a schedule's `vp`."""
    betas = np.linspace(vp["beta_start"] ** 0.5, vp["beta_end"] ** 0.5, vp["train_steps"]) ** 2
    cumulative = np.cumprod(1.0 - betas)
    cumulative = cumulative / (vp["snr_shift"] + (1.0 - vp["snr_shift"]) * cumulative)
    root = np.sqrt(cumulative)
    if vp["zero_terminal_snr"]:
        root = (root - root[-1]) * root[0] / (root[0] - root[-1])
    other = np.sqrt(1.0 - root**2)
    return other / (root + other)


def schedule(spec, grid):
    """Noise levels from the clean end for a latent grid (T, h, w), from the manifest."""
    steps = spec["steps"]
    if "vp" in spec:
        places = [int(np.round(i * spec["vp"]["train_steps"] / steps)) - 1 for i in range(1, steps + 1)]
        return np.concatenate([[0.0], vp_table(spec["vp"])[places]])
    if "shift" in spec:
        shift = spec["shift"]["shift"]
    else:
        by = spec["by_tokens"]
        tokens = np.prod(grid) / np.prod(by["patch"])
        log = by["base"] + by["slope"] * (tokens - by["from"]) / by["span"]
        shift = np.exp(min(log, np.log(by.get("most", np.inf))))
    t = np.arange(1, steps + 1) / steps
    t = shift * t / (1.0 + (shift - 1.0) * t)
    if "terminal" in spec:
        t = 1.0 - (1.0 - t) * (1.0 - spec["terminal"]) / (1.0 - t[0])
    return np.concatenate([[0.0], t])
