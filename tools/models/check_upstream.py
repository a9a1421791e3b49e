"""Checks the manifests against upstream code: modules of diffusers with tiny random weights.

  python tools/models/check_upstream.py [NAME ...] [--export]      needs torch and diffusers (0.42.1 was used) too

Each module's forward gets what its manifest says, under the manifest's names, at the sizes of the golden; the output must
have the shape that the manifest says. --export also writes the module as ONNX, traced at another size, as `obtain`
describes (onnxscript needed), and compares ONNX Runtime with torch; the encoders too, for a clip and for the photograph
alone.
"""
import argparse
import logging
import tempfile
import tomllib
import warnings
from pathlib import Path

import numpy as np
import torch
from diffusers import (
    AutoencoderKLCogVideoX,
    AutoencoderKLHunyuanVideo,
    AutoencoderKLLTXVideo,
    AutoencoderKLWan,
    CogVideoXTransformer3DModel,
    HunyuanVideoFramepackTransformer3DModel,
    LTXVideoTransformer3DModel,
    WanTransformer3DModel,
)
from diffusers.models.embeddings import get_3d_rotary_pos_embed

import feed

REPOSITORY = Path(__file__).resolve().parents[2]
KINDS = {"f32": torch.float32, "f16": torch.float16, "bf16": torch.bfloat16, "i64": torch.int64, "bool": torch.bool}
TEXT = {"text": (1, 6, 32)}
# diffusers' port of FramePack has other names than FramePack itself.
PORTED = {
    "latent_indices": "indices_latents",
    "clean_latents": "latents_clean",
    "clean_latent_indices": "indices_latents_clean",
    "clean_latents_2x": "latents_history_2x",
    "clean_latent_2x_indices": "indices_latents_history_2x",
    "clean_latents_4x": "latents_history_4x",
    "clean_latent_4x_indices": "indices_latents_history_4x",
    "image_embeddings": "image_embeds",
}


class Wrapped(torch.nn.Module):
    """What is exported: the module with the manifest's names, its first output alone."""

    def __init__(self, module):
        super().__init__()
        self.module = module

    def forward(self, **tensors):
        return self.module(**tensors, return_dict=False)[0]


class Wan(Wrapped):
    @staticmethod
    def build(channels, **more):
        common = dict(num_attention_heads=2, attention_head_dim=12, text_dim=32, freq_dim=16, ffn_dim=32, num_layers=2)
        return WanTransformer3DModel(**common, in_channels=channels, **more)


class Ltx(Wrapped):
    def forward(self, **tensors):
        # arange takes no tensors: the sizes become numbers, and the exporter is told what they are.
        sizes = {name: tensors[name].item() for name in ("num_frames", "height", "width")}
        for size in sizes.values():
            torch._check(size >= 1)
        torch._check(sizes["num_frames"] * sizes["height"] * sizes["width"] == tensors["hidden_states"].shape[1])
        return super().forward(**{**tensors, **sizes})

    @staticmethod
    def build():
        common = dict(num_attention_heads=2, attention_head_dim=12, cross_attention_dim=24)
        return LTXVideoTransformer3DModel(**common, num_layers=2, caption_channels=32)


class CogVideoX(Wrapped):
    def __init__(self, module):
        super().__init__(module)
        self.rotary = get_3d_rotary_pos_embed(16, ((0, 0), (1, 2)), (1, 2), 3)

    def forward(self, **tensors):
        return super().forward(**tensors, image_rotary_emb=self.rotary)

    @staticmethod
    def build():
        common = dict(num_attention_heads=2, attention_head_dim=16, in_channels=32, out_channels=16, time_embed_dim=8)
        positions = dict(use_rotary_positional_embeddings=True, use_learned_positional_embeddings=True)
        sample = dict(sample_width=4, sample_height=2, sample_frames=9, max_text_seq_length=6)
        return CogVideoXTransformer3DModel(**common, text_embed_dim=32, num_layers=2, **sample, **positions)


class FramePack(Wrapped):
    def forward(self, **tensors):
        # The port takes indices without a batch axis.
        tensors = {PORTED.get(k, k): v[0] if "indices" in k else v for k, v in tensors.items()}
        return super().forward(**tensors)

    @staticmethod
    def build():
        common = dict(num_attention_heads=2, attention_head_dim=16, num_layers=1, num_single_layers=1)
        condition = dict(text_embed_dim=32, pooled_projection_dim=8, has_image_proj=True, image_proj_dim=10)
        return HunyuanVideoFramepackTransformer3DModel(
            **common, num_refiner_layers=1, **condition, rope_axes_dim=(4, 6, 6), has_clean_x_embedder=True
        )


class Encoder(Wrapped):
    def forward(self, x):
        return self.module.encode(x).latent_dist.mode()


def hunyuan_codec():
    return AutoencoderKLHunyuanVideo(latent_channels=16, block_out_channels=(8,) * 4, layers_per_block=1, norm_num_groups=4)


def wan_codec(channels, **more):
    return AutoencoderKLWan(base_dim=8, z_dim=channels, num_res_blocks=1, **more)


def wan22_codec():
    return wan_codec(48, decoder_base_dim=8, is_residual=True, patch_size=2, in_channels=12, out_channels=12)


def ltx_codec():
    thin = dict(block_out_channels=(8,) * 4, layers_per_block=(1,) * 5)
    return AutoencoderKLLTXVideo(latent_channels=128, **thin, **{"decoder_" + k: v for k, v in thin.items()})


def cogvideox_codec():
    return AutoencoderKLCogVideoX(latent_channels=16, block_out_channels=(8,) * 4, layers_per_block=1, norm_num_groups=2)


# The codec, and what may stay symbolic in its encoder: nothing, height and width, or frames too.
CODECS = {
    "framepack": (hunyuan_codec, None),
    "framepack-f1": (hunyuan_codec, None),
    "wan2.1-i2v-14b": (lambda: wan_codec(16), "size"),
    "wan2.2-ti2v-5b": (wan22_codec, "size"),
    "ltx-video-2b": (ltx_codec, "frames"),
    "cogvideox-5b-i2v": (cogvideox_codec, None),
}
HUNYUAN = {**TEXT, "text_mask": (1, 6), "pooled": (1, 8), "image": (1, 5, 10)}
# The wrapped module, the shapes of the embeddings, and the latent grid it is traced at (None: sizes are fixed).
MODELS = {
    "framepack": (lambda: FramePack(FramePack.build()), HUNYUAN, (9, 4, 6)),
    "framepack-f1": (lambda: FramePack(FramePack.build()), HUNYUAN, (9, 4, 6)),
    "wan2.1-i2v-14b": (
        lambda: Wan(Wan.build(36, out_channels=16, image_dim=20, added_kv_proj_dim=24)),
        {**TEXT, "image": (1, 257, 20)},
        (5, 4, 6),
    ),
    "wan2.2-ti2v-5b": (lambda: Wan(Wan.build(48, out_channels=48)), TEXT, (5, 4, 6)),
    "ltx-video-2b": (lambda: Ltx(Ltx.build()), {**TEXT, "text_mask": (1, 6)}, (3, 4, 5)),
    "cogvideox-5b-i2v": (lambda: CogVideoX(CogVideoX.build()), TEXT, None),
}


def inputs(manifest, golden, embeddings, grid):
    """{name: tensor} by the manifest for a latent grid (T, h, w); 16-bit floats are widened, as the modules are f32."""
    rng = np.random.RandomState(1)
    latent = manifest["latent"]
    channels = latent["channels"]
    draw = lambda frames: rng.standard_normal((channels, frames, *grid[1:]))
    cell = latent["spatial"]
    sample = dict(z=draw(grid[0]), image=draw(1), history=draw(5), padding=int(golden["padding"]))
    sample["guidance"] = float(golden["guidance"])
    sample["image_frame"] = np.zeros((3, 1, grid[1] * cell, grid[2] * cell))
    sample["encode"] = lambda frames: draw((frames.shape[1] - 1) // latent["temporal"] + 1)
    spec = manifest["velocity"]["schedule"]
    table = feed.vp_table(spec["vp"]) if "vp" in spec else None
    made = feed.Feeder(manifest, sample, embeddings).tensors(float(golden["sigma"][0]), 1.0, table)
    tensors = {k: torch.from_numpy(np.asarray(a, order="C")).to(KINDS[d]) for k, (a, d) in made.items()}
    return {k: v.float() if v.is_floating_point() else v for k, v in tensors.items()}


def export(module, example, tensors, want, output="sample"):
    """The largest difference between torch and ONNX Runtime for `tensors`, traced with `example`; and the signature."""
    import onnxruntime

    moving = lambda a, b: {i: torch.export.Dim.DYNAMIC for i, (m, n) in enumerate(zip(a.shape, b.shape)) if m != n} or None
    shapes = {name: moving(example[name], tensors[name]) for name in example}
    shapes = shapes if isinstance(module, Encoder) else {"tensors": shapes}
    with torch.no_grad(), tempfile.TemporaryDirectory() as folder:
        options = dict(dynamo=True, opset_version=18, output_names=[output], verbose=False)
        program = torch.onnx.export(module, (), kwargs=example, dynamic_shapes=shapes, **options)
        path = folder + "/graph.onnx"
        program.save(path)
        session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
        feeds = {i.name: tensors[i.name].numpy() for i in session.get_inputs()}
        assert set(feeds) == set(tensors), f"the export has other inputs: {set(feeds) ^ set(tensors)}"
        return float(np.abs(session.run([output], feeds)[0] - want.numpy()).max())


def export_encoder(manifest, build, symbolic):
    """A line: the largest errors for a clip and for the photograph alone, and how far that is from latent 0 of a clip."""
    module = Encoder(build().eval())
    latent = manifest["latent"]
    cell, clip = latent["spatial"], 1 + 2 * latent["temporal"]
    assert ("encode_image" in manifest) == (symbolic != "frames"), "one graph serves both where frames are symbolic"
    draw = lambda frames, rows, columns: {"x": torch.randn(1, 3, frames, rows * cell, columns * cell)}
    errors = {}
    for role, frames in (("encode", clip), ("encode_image", 1)):
        tensors = draw(frames, 2, 4)
        traced = clip + latent["temporal"] if symbolic == "frames" else frames
        with torch.no_grad():
            want = module(**tensors)
        assert want.shape == (1, latent["channels"], 1 + (frames - 1) // latent["temporal"], 2, 4)
        example = draw(traced, 3, 5) if symbolic else tensors
        output = manifest.get(role, manifest["encode"])["output"]["name"]
        errors[frames] = export(module, example, tensors, want, output)
    longer = torch.cat([tensors["x"], draw(clip - 1, 2, 4)["x"]], dim=2)
    with torch.no_grad():
        apart = (module(longer)[:, :, :1] - want).abs().max()
    return f"clip {errors[clip]:.1e}, photograph {errors[1]:.1e}; it is {apart:.1e} from latent 0 of a clip"


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("names", nargs="*", metavar="NAME")
    arguments.add_argument("--export", action="store_true")
    options = arguments.parse_args()
    warnings.filterwarnings("ignore")
    logging.disable(logging.WARNING)
    torch.set_num_threads(1)
    for name in options.names or MODELS:
        build, shapes, traced = MODELS[name]
        torch.manual_seed(0)
        module = build().eval()
        manifest = tomllib.loads((REPOSITORY / "assets/models" / name / "model.toml").read_text())
        golden = np.load(REPOSITORY / "tests/models" / name / "golden.npz")
        rng = np.random.RandomState(0)
        draw = lambda key, shape: np.arange(shape[1])[None] < 3 if key.endswith("_mask") else rng.standard_normal(shape)
        embeddings = {key: draw(key, shape) for key, shape in shapes.items()}
        tensors = inputs(manifest, golden, embeddings, golden["z"].shape[1:])
        with torch.no_grad():
            answer = module(**tensors)
        wanted = feed.to_layout(golden["z"], manifest["velocity"]["output"]["layout"]).shape
        assert tuple(answer.shape) == wanted, f"{name}: {tuple(answer.shape)}, the manifest says {wanted}"
        print(f"{name:18} takes its {len(tensors)} inputs, answers {wanted}")
        if options.export:
            example = inputs(manifest, golden, embeddings, traced) if traced else dict(tensors)
            print(f"{'':18} exported: largest error {export(module, example, tensors, answer):.1e}")
            print(f"{'':18} encoders exported: largest error {export_encoder(manifest, *CODECS[name])}")


if __name__ == "__main__":
    main()
