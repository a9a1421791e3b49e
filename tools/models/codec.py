"""The tiny encoders and decoder: what they compute, in numpy and as ONNX graphs.

They are causal as the real ones: latent 0 is frame 0, latent k covers frames t(k-1)+1 ..= tk. Quarters of a latent cell
weigh differently, so a flipped or transposed picture shows. The encoder of images takes one frame alone and answers
otherwise than that of clips, as where norms run over time: so the wrong one shows.
"""
import numpy as np

from graph import Graph


class Codec:
    def __init__(self, channels, spatial, temporal, rng):
        self.c, self.s, self.t = channels, spatial, temporal
        draw = lambda *shape: rng.standard_normal(shape)
        order = np.abs(draw(3, temporal)) + 0.5  # weight of each frame of a group
        self.order = (order / order.sum(axis=1, keepdims=True)).astype("<f4")
        self.quarters = (draw(4, 3, 2, 2) * 0.6).astype("<f4")
        self.mix = (draw(channels, 4) * 0.5).astype("<f4")
        self.bias = (draw(channels) * 0.2).astype("<f4")
        self.colour = (draw(3, channels) * 0.04 / channels**0.5).astype("<f4")
        self.slope = (draw(3, channels) * 0.04 / channels**0.5).astype("<f4")
        ramp = lambda n, least: (least + (1.0 - least) * np.arange(n) / (n - 1)).astype("<f4")
        self.ramps = [ramp(temporal, 0.5), ramp(spatial, -1.0), ramp(spatial, -0.25)]

    def encode(self, x):
        """Frames [3,F,H,W] in the network's range to raw latents [C,T,h,w], in f64."""
        x = np.concatenate([np.repeat(x[:, :1], self.t - 1, axis=1), x], axis=1).astype(np.float64)
        _, frames, height, width = x.shape
        half = self.s // 2
        x = np.einsum("ctjyx,cj->ctyx", x.reshape(3, frames // self.t, self.t, height, width), self.order)
        x = x.reshape(3, frames // self.t, height // half, half, width // half, half).mean(axis=(3, 5))
        x = x.reshape(3, frames // self.t, height // self.s, 2, width // self.s, 2)
        x = np.einsum("ctyixj,qcij->qtyx", x, self.quarters.astype(np.float64))
        return self.mixed(x, self.mix)

    def encode_image(self, x):
        """One frame [3,1,H,W] in the network's range to the raw latent [C,1,h,w], in f64."""
        _, _, height, width = x.shape
        half = self.s // 2
        x = np.asarray(x, dtype=np.float64).reshape(3, 1, height // half, half, width // half, half).mean(axis=(3, 5))
        x = x.reshape(3, 1, height // self.s, 2, width // self.s, 2)
        x = np.tanh(np.einsum("ctyixj,qcij->qtyx", x, self.quarters.astype(np.float64)))
        return self.mixed(x, -self.mix[::-1])

    def mixed(self, x, mix):
        """Four numbers a cell [4,T,h,w] to latents [C,T,h,w]."""
        return np.einsum("dq,qtyx->dtyx", mix.astype(np.float64), x) + self.bias[:, None, None, None]

    def decode(self, z):
        """Raw latents [C,T,h,w] to frames [3,F,H,W] in the network's range, in f64."""
        flat = np.einsum("dc,ctyx->dtyx", self.colour.astype(np.float64), z)
        tilt = np.einsum("dc,ctyx->dtyx", self.slope.astype(np.float64), z)
        cell = self.ramps[0][:, None, None] + self.ramps[1][:, None] + self.ramps[2].astype(np.float64)
        out = flat[..., None, None, None] + tilt[..., None, None, None] * cell  # [3,T,h,w,t,s,s]
        out = out.transpose(0, 1, 4, 2, 5, 3, 6)
        _, count, _, h, _, w, _ = out.shape
        return out.reshape(3, count * self.t, h * self.s, w * self.s)[:, self.t - 1 :]

    def encode_graph(self, manifest):
        """x [1,3,F,H,W] to the raw latent [1,C,T,h,w]."""
        g = Graph()
        source, target = manifest["input"], manifest["output"]
        x = g.f32(g.input(source["name"], source["dtype"], [1, 3, "frames", "height", "width"]))
        first = g.op("Slice", x, g.ints(0), g.ints(1), g.ints(2))
        x = g.op("Concat", *[first] * (self.t - 1), x, axis=2)
        order = g.weight(self.order.reshape(3, 1, self.t, 1, 1))
        x = g.op("Conv", x, order, group=3, kernel_shape=[self.t, 1, 1], strides=[self.t, 1, 1])
        x = self.mixed_in(g, self.cells(g, x), self.mix)
        g.output(x, target["name"], target["dtype"], [1, self.c, "latents", "rows", "columns"])
        return g

    def encode_image_graph(self, manifest):
        """x [1,3,1,H,W] to the raw latent [1,C,1,h,w]."""
        g = Graph()
        source, target = manifest["input"], manifest["output"]
        x = g.f32(g.input(source["name"], source["dtype"], [1, 3, 1, "height", "width"]))
        x = self.mixed_in(g, g.op("Tanh", self.cells(g, x)), -self.mix[::-1])
        g.output(x, target["name"], target["dtype"], [1, self.c, 1, "rows", "columns"])
        return g

    def cells(self, g, x):
        """Four numbers a cell."""
        half = [1, self.s // 2, self.s // 2]
        x = g.op("AveragePool", x, kernel_shape=half, strides=half)
        quarters = g.weight(self.quarters.reshape(4, 3, 1, 2, 2))
        return g.op("Conv", x, quarters, kernel_shape=[1, 2, 2], strides=[1, 2, 2])

    def mixed_in(self, g, x, mix):
        return g.op("Conv", x, g.weight(mix.reshape(self.c, 4, 1, 1, 1)), g.weight(self.bias), kernel_shape=[1, 1, 1])

    def decode_graph(self, manifest):
        """z [1,C,T,h,w] to frames [1,3,F,H,W]."""
        g = Graph()
        source, target = manifest["input"], manifest["output"]
        z = g.f32(g.input(source["name"], source["dtype"], [1, self.c, "latents", "rows", "columns"]))
        dim = g.dims(z)
        last = g.op("Transpose", z, perm=[0, 2, 3, 4, 1])

        def mix(weights):
            mixed = g.op("Transpose", g.op("MatMul", last, g.weight(weights.T.copy())), perm=[0, 4, 1, 2, 3])
            return g.reshape(mixed, 3, dim(2), 1, dim(3), 1, dim(4), 1)

        ramps = zip(self.ramps, ([1, 1, -1, 1, 1, 1, 1], [1, 1, 1, 1, -1, 1, 1], [1, 1, 1, 1, 1, 1, -1]))
        cell = g.add(*[g.weight(ramp.reshape(shape)) for ramp, shape in ramps])
        out = g.add(mix(self.colour), g.op("Mul", mix(self.slope), cell))  # [3,T,t,h,s,w,s]
        times = lambda axis, n: g.op("Mul", dim(axis), g.ints(n))
        out = g.reshape(out, 1, 3, times(2, self.t), times(3, self.s), times(4, self.s))
        far = np.iinfo(np.int64).max
        out = g.op("Slice", out, g.ints(self.t - 1), g.ints(far), g.ints(2))
        g.output(out, target["name"], target["dtype"], [1, 3, "frames", "height", "width"])
        return g
