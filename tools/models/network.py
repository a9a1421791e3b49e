"""The tiny velocity network: one formula that reads every input of a model, in numpy and as ONNX graphs.

Channels last, x[t,y,x] the main input (latents, and mask and image where they are concatenated), C latent channels:

    h = V x,  s = D x[:C] + U [h, roll_x h, roll_y h, roll_t h] + B + G [tau, sin(30 tau)]     tau = timestep / 1000
      + sum over embeddings  P mean over tokens of (weight of the place) (mask) value
      + L guidance / 10000 + S (rope scale . [1, 1/64, 1/128])
      + sum over groups of clean latents  W sum_j K(index[t] - index_j) (Y clean_j[y,x]),     K(d) = 1 / (1 + (d/4)^2)

The rolls tie the result to the order of the axes, K to the indices, the weights of places to the order of tokens. A network
in two graphs adds E roll_x(s) in the second.
"""
import numpy as np

from graph import Graph

ROPE = np.array([1.0, 1 / 64, 1 / 128])
PLACES = {"BCTHW": ([0, 2, 3, 4, 1], [0, 4, 1, 2, 3]), "BTCHW": ([0, 1, 3, 4, 2], [0, 1, 4, 2, 3])}


class Network:
    def __init__(self, manifest, embeddings, rng):
        """`embeddings`: {key: array [1,L,D] or [1,D]}, for their sizes."""
        self.manifest = manifest
        self.inputs = manifest["velocity"]["inputs"]
        self.c = c = manifest["latent"]["channels"]
        self.rank = rank = {16: 4, 48: 2}.get(c, 1)  # files stay small
        draw = lambda scale, *shape: (rng.standard_normal(shape) * scale).astype("<f4")
        main = self.inputs[0]
        widths = {"latents": c, "image": c, "mask": main.get("mask_channels", 0)}
        self.width = width = sum(widths[part] for part in main.get("parts", ["latents"]))
        self.V, self.U = draw(0.7 / width**0.5, rank, width), draw(0.3, c, 4 * rank)
        self.D, self.B, self.G = draw(0.3, c) + np.float32(0.6), draw(0.2, c), draw(0.8, c, 2)
        self.places, self.P = {}, {}
        for item in self.inputs:
            key = item.get("key", "")
            if item.get("source") == "embedding" and not key.endswith("_mask"):
                shape = embeddings[key].shape
                self.places[key] = (1.0 / (1.0 + np.arange(shape[1]))).astype("<f4") if len(shape) == 3 else None
                self.P[key] = draw(1.0, c, shape[-1])
        self.L, self.S, self.E = draw(0.5, c), draw(0.3, c), draw(0.3, c)
        self.groups = [i for i in self.inputs if i["name"].startswith("clean_latents")]
        self.Y = [draw(0.3, rank, c) for _ in self.groups]
        self.W = [draw(0.5, c, rank) for _ in self.groups]
        self.split = len(manifest["velocity"]["graphs"]) == 2

    def reference(self, x, timestep, embeddings, guidance=None, rope=None, groups=()):
        """x [Cin,T,h,w], timestep a number or [T,h,w], groups [(latents [C,n,h,w], distances [T,n])]: [C,T,h,w] in f64."""
        wide = lambda array: np.asarray(array, dtype=np.float64)
        x = np.moveaxis(wide(x), 0, -1)
        tau = np.broadcast_to(wide(timestep) / 1000.0, x.shape[:3])
        h = x @ wide(self.V).T
        h = np.concatenate([h] + [np.roll(h, 1, axis=axis) for axis in (2, 1, 0)], axis=-1)
        s = wide(self.D) * x[..., : self.c] + h @ wide(self.U).T + self.B
        s = s + np.stack([tau, np.sin(30.0 * tau)], axis=-1) @ wide(self.G).T
        for key, matrix in self.P.items():
            value = wide(embeddings[key][0])
            if self.places[key] is not None:
                mask = wide(embeddings.get(key + "_mask", np.ones((1, len(value))))[0])
                value = (self.places[key] * mask) @ value / mask.sum()
            s = s + wide(matrix) @ value
        if guidance is not None:
            s = s + wide(self.L) * (guidance / 10000.0)
        if rope is not None:
            s = s + wide(self.S) * (ROPE @ wide(rope))
        for (clean, distances), inner, outer in zip(groups, self.Y, self.W):
            clean = np.moveaxis(wide(clean), 0, -1) @ wide(inner).T
            near = np.einsum("tn,nyxr->tyxr", 1.0 / (1.0 + (distances / 4.0) ** 2), clean)
            s = s + near @ wide(outer).T
        if self.split:
            s = s + wide(self.E) * np.roll(s, 1, axis=2)
        return np.moveaxis(s, -1, 0)

    def graphs(self):
        """The graphs in order; of two, the first ends with tokens, time and context."""
        g, tensors = Graph(), {}
        for item in self.inputs:
            tensors[item["name"]] = (g.input(item["name"], item["dtype"], self.shape(item)), item)
        value = {name: g.f32(tensor) for name, (tensor, _) in tensors.items()}
        of = lambda source: next(n for n, (_, i) in tensors.items() if i.get("source") == source)
        main = self.inputs[0]
        if main["layout"] == "BNC":
            # A wrong size or order of sizes changes the rolls below.
            sizes = [g.reshape(tensors[of(s)][0], 1) for s in ("frames", "height", "width")]
            x = g.reshape(value[main["name"]], 1, *sizes, self.c)
        else:
            x = g.op("Transpose", value[main["name"]], perm=PLACES[main["layout"]][0])
        dim = g.dims(x)
        h = g.op("MatMul", x, g.weight(self.V.T.copy(), "V"))
        h = g.op("Concat", h, *[g.roll(h, axis) for axis in (3, 2, 1)], axis=4)
        latents = g.op("Slice", x, g.ints(0), g.ints(self.c), g.ints(4)) if self.width > self.c else x
        s = g.add(g.op("Mul", latents, g.weight(self.D)), g.op("MatMul", h, g.weight(self.U.T.copy(), "U")))
        s = g.add(s, g.weight(self.B))
        time = self.time(g, value, dim)
        context = self.context(g, value)
        for item, inner, outer in zip(self.groups, self.Y, self.W):
            s = g.add(s, self.clean(g, value, item, dim, inner, outer))
        if not self.split:
            self.finish(g, g.add(s, time, *context), dim)
            return [g]
        wide = ["batch", "latents", "rows", "columns", self.c]
        chain = {"tokens": (s, wide), "time": (time, [1, 1, 1, 1, self.c]), "context": (g.add(*context), [self.c])}
        for name, (tensor, shape) in chain.items():
            g.output(tensor, name, "f32", shape)
        second = Graph()
        s = second.add(*[second.input(name, "f32", shape) for name, (_, shape) in chain.items()])
        s = second.add(s, second.op("Mul", second.roll(s, 3), second.weight(self.E)))
        self.finish(second, s, second.dims(s))
        return [g, second]

    def time(self, g, value, dim):
        """Its part of s, [1,1,1,1,C] or, by token, [1,T,h,w,C]."""
        name, item = next((i["name"], i) for i in self.inputs if i.get("source") in ("sigma", "timestep"))
        tau = g.op("Mul", value[name], g.weight(1e-3))
        if item.get("per") == "token":
            _, py, px = item["patch"]
            half = lambda axis, n: g.op("Div", dim(axis), g.ints(n))
            tau = g.reshape(tau, 1, dim(1), half(2, py), 1, half(3, px), 1)
            tau = g.op("Tile", tau, g.ints(1, 1, 1, py, 1, px))
            tau = g.reshape(tau, 1, dim(1), dim(2), dim(3), 1)
        else:
            tau = g.reshape(tau, 1, 1, 1, 1, 1)
        both = g.op("Concat", tau, g.op("Sin", g.op("Mul", tau, g.weight(30.0))), axis=4)
        return g.op("MatMul", both, g.weight(self.G.T.copy(), "G"))

    def context(self, g, value):
        """The parts of s, each [C], that are the same everywhere."""
        named = {item.get("key") or item.get("source"): value[item["name"]] for item in self.inputs[1:]}
        parts = []
        for key, matrix in self.P.items():
            mean = named[key]
            if self.places[key] is not None:
                places, axis = g.weight(self.places[key].reshape(1, -1, 1)), g.ints(1)
                if key + "_mask" in named:
                    mask = g.op("Unsqueeze", named[key + "_mask"], g.ints(2))
                    count = g.op("ReduceSum", mask, axis, keepdims=0)
                    mean = g.op("Mul", g.op("Mul", mean, mask), places)
                    mean = g.op("Div", g.op("ReduceSum", mean, axis, keepdims=0), count)
                else:
                    mean = g.op("ReduceMean", g.op("Mul", mean, places), axis, keepdims=0)
            parts.append(g.reshape(g.op("MatMul", mean, g.weight(matrix.T.copy(), "P")), self.c))
        if "guidance" in named:
            parts.append(g.op("Mul", g.op("Mul", named["guidance"], g.weight(1e-4)), g.weight(self.L)))
        if "constant" in named:
            dot = g.op("ReduceSum", g.op("Mul", named["constant"], g.weight(ROPE)), g.ints(0), keepdims=1)
            parts.append(g.op("Mul", dot, g.weight(self.S)))
        return parts

    def clean(self, g, value, item, dim, inner, outer):
        """What one group of clean latents adds, [1,T,h,w,C]."""
        clean = g.op("Transpose", value[item["name"]], perm=PLACES["BCTHW"][0])
        clean = g.op("MatMul", clean, g.weight(inner.T.copy(), "Y"))
        count = g.dims(clean)(1)
        where = value[item["name"].replace("latents", "latent", 1) + "_indices"]
        distance = g.op("Sub", g.reshape(value["latent_indices"], 1, dim(1), 1), g.reshape(where, 1, 1, count))
        quarter = g.op("Mul", distance, g.weight(0.25))
        kernel = g.op("Reciprocal", g.add(g.op("Mul", quarter, quarter), g.weight(1.0)))
        near = g.op("MatMul", kernel, g.reshape(clean, 1, count, -1))
        near = g.reshape(near, 1, dim(1), dim(2), dim(3), self.rank)
        return g.op("MatMul", near, g.weight(outer.T.copy(), "W"))

    def finish(self, g, s, dim):
        """Lays s [1,T,h,w,C] out as the manifest says."""
        output = self.manifest["velocity"]["output"]
        layout = output["layout"]
        if layout == "BNC":
            s = g.reshape(s, 1, -1, self.c)
        else:
            s = g.op("Transpose", s, perm=PLACES[layout][1])
        g.output(s, output["name"], output["dtype"], self.latent_shape(layout, self.c))

    def latent_shape(self, layout, channels, frames="latents"):
        return {
            "BCTHW": ["batch", channels, frames, "rows", "columns"],
            "BTCHW": ["batch", frames, channels, "rows", "columns"],
            "BNC": ["batch", "tokens", channels],
        }[layout]

    def shape(self, item):
        """The declared shape of an input."""
        name, source = item["name"], item.get("source")
        if "layout" in item:
            slots = name if item in self.groups else "latents"
            return self.latent_shape(item["layout"], self.c if item in self.groups else self.width, slots)
        if source in ("sigma", "timestep", "guidance", "frames", "height", "width"):
            return {"batch": ["batch"], "scalar": [], "token": ["batch", "tokens"]}[item["per"]]
        if source == "indices":
            return ["batch", name + "_count"]
        if source == "constant":
            return item["shape"]
        key = item["key"].removesuffix("_mask")
        length = len(self.places[key]) if self.places[key] is not None else None
        if item["key"] != key:
            return ["batch", length]
        return ["batch"] + ([length] if length else []) + [self.P[key].shape[1]]
