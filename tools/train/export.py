"""Writes encode.onnx, decode.onnx and velocity.onnx from checkpoints, and checks them against PyTorch.

    python export.py --work DIR --out DIR

Weights are stored in half precision, arithmetic is in single precision. Without checkpoints in DIR the networks are
untrained, which is enough to test what reads the files.
"""

import argparse
import copy
import io
import pathlib
import sys

import numpy as np
import onnx
import onnxruntime
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import nn

import store
from vae import LATENT_CHANNELS

OPSET = 17
HALVED_FROM = 64  # smaller tensors stay in single precision: they hold shapes and norms, and weigh nothing


class Encode(nn.Module):
    def __init__(self, vae):
        super().__init__()
        self.vae = vae

    def forward(self, video):
        return self.vae.encode(video)


class Decode(nn.Module):
    def __init__(self, vae):
        super().__init__()
        self.vae = vae

    def forward(self, latent):
        return self.vae.decode(latent)


def halve_weights(graph):
    """Stores every large f32 initializer as f16 behind a Cast to f32."""
    casts, kept = [], []
    for tensor in graph.initializer:
        values = numpy_helper.to_array(tensor)
        if tensor.data_type != TensorProto.FLOAT or values.size < HALVED_FROM:
            kept.append(tensor)
            continue
        kept.append(numpy_helper.from_array(values.astype(np.float16), tensor.name + ".f16"))
        casts.append(helper.make_node("Cast", [tensor.name + ".f16"], [tensor.name], to=TensorProto.FLOAT))
    del graph.initializer[:]
    graph.initializer.extend(kept)
    nodes = list(graph.node)
    del graph.node[:]
    graph.node.extend(casts + nodes)


def write(module, inputs, output, axes, path, note):
    """Traces `module` at `inputs`, tensors by name, and writes the file."""
    held = io.BytesIO()
    torch.onnx.export(
        module,
        tuple(inputs.values()),
        held,
        input_names=list(inputs),
        output_names=[output],
        opset_version=OPSET,
        dynamic_axes=axes,
        dynamo=False,
    )
    model = onnx.load_from_string(held.getvalue())
    halve_weights(model.graph)
    # The tracer forgets what no axis changes: one clip, a fixed number of channels.
    with torch.no_grad():
        known = module(*inputs.values()).shape[:2]
    for size, dimension in zip(known, model.graph.output[0].type.tensor_type.shape.dim[:2], strict=True):
        dimension.dim_value = size
    model.doc_string = note
    onnx.checker.check_model(model)
    path.write_bytes(model.SerializeToString())


def round_weights(module):
    """The weights as the file holds them, so that the comparison with PyTorch is of the arithmetic alone."""
    with torch.no_grad():
        for values in [*module.parameters(), *module.buffers()]:
            if values.dtype == torch.float32 and values.numel() >= HALVED_FROM:
                values.copy_(values.half().float())


def check(condition, claim):
    """Says whether a claim holds."""
    print(("ok    " if condition else "FAILS ") + claim)
    return condition


def runtime(path):
    """A session that keeps files as they are: no precision is given away by the graph optimiser."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 2
    return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])


def verify(out, vae, velocity):
    """Every claim of the contract that can be checked without knowing what the networks learned."""
    encode, decode, flow = (runtime(out / f"{name}.onnx") for name in ("encode", "decode", "velocity"))
    whole = [np.concatenate([p.detach().numpy().ravel() for p in m.parameters()]) for m in (vae, velocity)]
    good = check(all(np.isfinite(w).all() and np.abs(w).max() < 6e4 for w in whole), "weights fit half precision")
    generator = torch.Generator().manual_seed(7)
    noise = lambda *shape: torch.randn(*shape, generator=generator)  # noqa: E731

    def compare(what, session, feed, module, tolerance):
        got = session.run(None, {k: v.numpy() for k, v in feed.items()})[0]
        with torch.no_grad():
            want = module(*feed.values()).numpy()
        error = np.abs(got - want).max() if got.shape == want.shape else np.inf
        return check(error <= tolerance, f"{what}: {list(got.shape)}, largest error {error:.1e}"), got

    full = {"encode": Encode(vae), "decode": Decode(vae), "velocity": velocity}
    for frames, size in ((37, 64), (37, 128), (1, 64), (73, 64), (5, 256)):
        k, h = 1 + (frames - 1) // 4, size // 8
        video = torch.rand(1, 3, frames, size, size, generator=generator) * 2 - 1
        note = f"{frames} frames of {size} x {size}"
        same, latent = compare(f"encode {note}", encode, {"video": video}, full["encode"], 1e-3)
        good &= same & check(latent.shape == (1, LATENT_CHANNELS, k, h, h), "  latent shape")
        same, frame = compare(f"decode {note}", decode, {"latent": noise(1, 16, k, h, h)}, full["decode"], 1e-3)
        good &= same & check(frame.shape == tuple(video.shape) and np.abs(frame).max() <= 1, "  video shape, range")
        x = noise(1, 33, k, h, h)
        x[:, 16] = (torch.arange(k) == 0)[None, :, None, None].float()
        x[:, 17:, 1:] = 0
        good &= compare(f"velocity {note}", flow, {"x": x, "sigma": torch.tensor([0.9])}, velocity, 1e-3)[0]

    video = np.random.default_rng(3).uniform(-1, 1, (1, 3, 37, 64, 64)).astype(np.float32)
    other = video.copy()
    other[:, :, 17:] = np.random.default_rng(4).uniform(-1, 1, other[:, :, 17:].shape)
    a, b = (encode.run(None, {"video": v})[0] for v in (video, other))
    same = np.abs(a - b).max(axis=(0, 1, 3, 4))
    good &= check(
        same[:5].max() < 1e-5 and same[5:].min() > 1e-3, "encode is causal: frames 17.. reach only latents 5.."
    )
    c = a.copy()
    c[:, :, 5:] = b[:, :, 5:] + 1
    a, b = (decode.run(None, {"latent": v})[0] for v in (a, c))
    same = np.abs(a - b).max(axis=(0, 1, 3, 4))
    good &= check(
        same[:17].max() < 1e-5 and same[17:].max() > 1e-3, "decode is causal: latents 5.. reach frames 17.. only"
    )
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=pathlib.Path, required=True)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    options = parser.parse_args()
    torch.set_num_threads(2)
    vae, trained_vae = store.load_vae(options.work)
    velocity, trained_flow = store.load_velocity(options.work)
    print(f"autoencoder: {trained_vae}; flow: {trained_flow}")
    exact = copy.deepcopy(velocity)
    for module in (vae, velocity):
        round_weights(module.eval())
    x, sigma = torch.randn(1, 33, 10, 8, 8), torch.tensor([0.9])
    with torch.no_grad():
        change = (exact(x, sigma) - velocity(x, sigma)).square().mean().sqrt() / exact(x, sigma).square().mean().sqrt()
    print(f"rounding the weights to half precision changes a prediction by {float(change):.1e} of its size")

    options.out.mkdir(parents=True, exist_ok=True)
    note = f"autoencoder: {trained_vae}; flow: {trained_flow}. MIT OR Apache-2.0"
    frames, places = {2: "T", 3: "H", 4: "W"}, {2: "Tl", 3: "h", 4: "w"}
    video, latent, sigma = torch.rand(1, 3, 9, 64, 64) * 2 - 1, torch.randn(1, 16, 3, 8, 8), torch.tensor([0.5])
    x = torch.randn(1, 33, 3, 8, 8)
    # Module, inputs by name, the output's name; the dynamic axes follow from whether a tensor is in frames or latents.
    graphs = {
        "encode": (Encode(vae), {"video": video}, "latent"),
        "decode": (Decode(vae), {"latent": latent}, "video"),
        "velocity": (velocity, {"x": x, "sigma": sigma}, "prediction"),
    }
    axes = {"video": frames, "latent": places, "x": places, "prediction": places}
    for name, (module, inputs, output) in graphs.items():
        used = {key: axes[key] for key in [*inputs, output] if key in axes}
        write(module, inputs, output, used, options.out / f"{name}.onnx", note)
    sizes = {p.name: p.stat().st_size for p in sorted(options.out.glob("*.onnx"))}
    print(", ".join(f"{name} {size / 1e6:.2f} MB" for name, size in sizes.items()))
    good = check(sum(sizes.values()) <= 8_000_000, f"together {sum(sizes.values()) / 1e6:.2f} MB")
    good &= verify(options.out, vae, velocity)
    sys.exit(0 if good else "export.py: the files do not keep the contract")


if __name__ == "__main__":
    main()
