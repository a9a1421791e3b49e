"""Writes tests/models/NAME/ for every model of assets/models: graphs of a few KB with its exact signature, and goldens.

  python tools/models/make_contracts.py [NAME ...] [--out FOLDER] [--check]

With onnxruntime installed every graph is run by its manifest and compared with numpy. --check writes nothing and fails if
the folder differs from what would be written.
"""
import argparse
import re
import sys
import tempfile
import tomllib
import zipfile
import zlib
from io import BytesIO
from pathlib import Path

import numpy as np

import facts
import feed
from codec import Codec
from network import Network

REPOSITORY = Path(__file__).resolve().parents[2]
TEXT_TOKENS, IMAGE_TOKENS, WIDTH = 6, 5, 3  # sizes that the signatures leave open


def derive(text, name, model, hashes):
    """The tiny manifest from the real one's text: other words, sizes and hashes; everything else stays."""
    for key, value in {
        "name": name + "-contract",
        "description": f"Tiny random graphs with the signature of {name}; they make no pictures",
        "licence": "MIT OR Apache-2.0",
        "obtain": "python tools/models/make_contracts.py",
    }.items():
        line = f'{key} = "{value}"'
        text, count = re.subn(rf'^{key} = (?:"""[\s\S]*?"""|".*")$', lambda _: line, text, count=1, flags=re.M)
        assert count == 1, key
    if "size" in model:
        text = re.sub(r"^size = .*$", f"size = {list(model['size'])}", text, flags=re.M)
        text = re.sub(r"^frames = .*$", f"frames = {model['frames']}", text, flags=re.M)
    for file, digest in hashes.items():
        text = text.replace(f'file = "{file}"', f'file = "{file}", sha256 = "{digest}"')
    return text


def compare(real, tiny):
    """Fails unless both manifests are equal in everything but words, sizes and hashes."""
    real, tiny = dict(real), dict(tiny)
    for key in ("name", "description", "licence", "obtain"):
        assert real.pop(key) and tiny.pop(key)
    for manifest in (real, tiny):
        manifest["latent"] = {k: v for k, v in manifest["latent"].items() if k != "size"}
        manifest["chunk"] = {k: v for k, v in manifest["chunk"].items() if k != "frames"}
        for role in ("encode", "encode_image", "decode", "velocity"):
            for graph in manifest.get(role, {}).get("graphs", []):
                for file in [graph, *graph.get("data", [])]:
                    file.pop("sha256", None)
    assert real == tiny, "the tiny manifest says something else than the real one"


def write_npz(path, arrays):
    """An NPZ whose bytes depend on its content alone."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, array in arrays.items():
            content = BytesIO()
            np.lib.format.write_array(content, np.asarray(array, order="C"), version=(1, 0), allow_pickle=False)
            info = zipfile.ZipInfo(name + ".npy", date_time=(1980, 1, 1, 0, 0, 0))
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, content.getvalue())


def short(array):
    """f32 with the last 6 bits zero, so that the file packs better; a fifth of the tolerance."""
    bits = np.asarray(array, dtype="<f4").view("<u4")
    return ((bits + np.uint32(0x20)) & np.uint32(0xFFFFFFC0)).view("<f4")


def picture(frames, height, width, cell, rng):
    """Frames [3,F,H,W] in 1/64ths of 0..1: a pattern of period 8 over random quarters of latent cells."""
    c, t, y, x = np.ogrid[:3, :frames, :height, :width]
    pattern = (c * 5 + t * 3 + y * 2 + x * 7) % 8
    quarters = rng.randint(4, 49, size=(3, frames, 2 * height // cell, 2 * width // cell))
    return ((pattern + quarters.repeat(cell // 2, axis=2).repeat(cell // 2, axis=3)) / 64).astype("<f4")


def embeddings_of(manifest, rng):
    """({key: array} of the prompt, the same of the negative prompt or None), with masks of different lengths."""
    keys = [i["key"] for i in manifest["velocity"]["inputs"] if i.get("source") == "embedding"]
    shapes = {"text": (1, TEXT_TOKENS, WIDTH), "pooled": (1, WIDTH), "image": (1, IMAGE_TOKENS, WIDTH)}

    def draw(length):
        arrays = {}
        for key in keys:
            if key.endswith("_mask"):
                arrays[key] = np.arange(TEXT_TOKENS)[None] < length
            else:
                arrays[key] = rng.standard_normal(shapes[key]).astype("<f4")
        return arrays

    prompt = draw(4)
    if manifest["velocity"]["guidance"]["kind"] != "cfg":
        return prompt, None
    negative = draw(2)
    negative.pop("image", None)  # the same photograph: taken from the prompt's file
    return prompt, negative


class Normalisation:
    """Of a role: raw latents to latents and back, colours to the network's range and back."""

    def __init__(self, role):
        std = 1.0 / role["latent_scale"] if "latent_scale" in role else role.get("latent_std", 1.0)
        self.mean = np.reshape(np.array(role.get("latent_mean", 0.0), dtype=np.float64), (-1, 1, 1, 1))
        self.std = np.reshape(np.array(std, dtype=np.float64), (-1, 1, 1, 1))
        self.low, self.high = role["range"]

    def colours(self, x):
        return self.low + np.asarray(x, dtype=np.float64) * (self.high - self.low)


def goldens(name, model, manifest, codec, network, prompt, negative, rng):
    """(arrays of golden.npz, sample for the feeder)."""
    latent = manifest["latent"]
    channels, cell = latent["channels"], latent["spatial"]
    t, h, w = model["grid"]
    back = Normalisation(manifest["decode"])

    def encode(frames):
        alone = frames.shape[1] == 1 and "encode_image" in manifest
        into = Normalisation(manifest["encode_image" if alone else "encode"])
        raw = (codec.encode_image if alone else codec.encode)(into.colours(frames))
        return (raw - into.mean) / into.std

    frames = picture(model["clip"], cell, 2 * cell, cell, rng)
    normal = lambda *shape: (np.round(rng.standard_normal(shape) * 64) / 64).astype("<f4")
    latents_in = normal(channels, 2, 1, 2)
    decoded = codec.decode(latents_in * back.std + back.mean)
    decoded = (decoded - back.low) / (back.high - back.low)
    assert 0.0 < decoded.min() and decoded.max() < 1.0, "the goldens stay inside, whether colours are cut to 0..1 or not"
    places = np.stack([rng.randint(0, n, size=140) for n in decoded.shape], axis=1)

    image_frame = picture(1, h * cell, w * cell, cell, rng)
    image = normal(channels, 1, h, w)
    z = normal(channels, t, h, w)
    if latent["first"] == "clamped":
        z[:, :1] = image
    guidance = manifest["velocity"]["guidance"].get("scale", 0.0)
    sample = dict(z=z, image=image, image_frame=image_frame, encode=encode, guidance=guidance)
    sample["padding"] = model.get("padding", 0)
    sample["history"] = normal(channels, model["history"], h, w) if "history" in model else None

    levels = model["schedule"](*model["grid"])
    assert len(levels) == model["steps"] + 1
    assert np.abs(levels - feed.schedule(manifest["velocity"]["schedule"], model["grid"])).max() < 1e-12, name
    sigma = np.array([levels[round(0.8 * model["steps"])], 0.3728][: model.get("levels", 2)])
    vp = model.get("vp", False)
    prediction = {True: "vp_v", False: "eps_minus_x0"}[vp]
    assert manifest["velocity"]["prediction"] == prediction

    def velocity(embeddings, level):
        embeddings = {k: v if v.dtype == bool else facts.rounded(v, model["dtype"]) for k, v in embeddings.items()}
        given = model["inputs"](sample, level)
        answer = network.reference(embeddings=embeddings, **given)
        answer = facts.rounded(answer, manifest["velocity"]["output"]["dtype"])
        return facts.towards_data(answer, z.astype(np.float64), level, vp)

    golden = dict(z=z, image=image, image_frame=image_frame, image_encoded=short(encode(image_frame)))
    if sample["history"] is not None:
        golden["history"] = sample["history"]
    conditional = np.stack([velocity(prompt, s) for s in sigma])
    golden.update(padding=np.int64(sample["padding"]), sigma=sigma, guidance=np.float64(guidance))
    golden["v_conditional"] = short(conditional)
    if negative is not None:
        other = np.stack([velocity({**prompt, **negative}, s) for s in sigma])
        golden["v_unconditional"] = short(other)
        golden["v"] = short((other + guidance * (conditional - other))[:1])
    golden.update(schedule=levels, frames=frames, latents=encode(frames).astype("<f4"), latents_in=latents_in)
    golden.update(decoded_shape=np.array(decoded.shape, dtype=np.int64), decoded_at=places.astype(np.int64))
    golden.update(decoded=decoded[tuple(places.T)].astype("<f4"), tolerance=np.float64(model["tolerance"]))
    return golden, sample


def run(runtime, folder, manifest, golden, sample, prompt, negative):
    """The largest error of each role when the graphs are run by the manifest, and the least effect of a mistake, both as
    parts of the tolerance."""
    worst = {}
    error = lambda got, want: float((np.abs(got - want) / (1.0 + np.abs(want))).max() / golden["tolerance"])
    shape = golden["z"].shape
    velocity = manifest["velocity"]
    for branch, embeddings in (("conditional", prompt), ("unconditional", negative and {**prompt, **negative})):
        if embeddings is None:
            continue
        session = feed.Session(runtime, folder, velocity)
        feeder = feed.Feeder(manifest, sample, embeddings)
        spec = velocity["schedule"]
        table = feed.vp_table(spec["vp"]) if "vp" in spec else None
        for i, sigma in enumerate(golden["sigma"]):
            p, l, scale = feed.coefficients(velocity["prediction"], sigma)
            tensors = feeder.tensors(sigma, scale, table)
            answer = session.run(tensors, velocity["output"]["name"])
            got = p * feed.from_layout(answer, velocity["output"]["layout"], shape) + l * golden["z"]
            worst[branch] = max(worst.get(branch, 0.0), error(got, golden["v_" + branch][i]))
            mistake = shown(session, tensors, answer, velocity["output"]["name"], golden)
            worst["least mistake"] = min(worst.get("least mistake", np.inf), mistake)

    def encode(role, frames):
        norm = Normalisation(role)
        tensor = {role["input"]["name"]: (norm.colours(frames)[None], role["input"]["dtype"])}
        got = feed.Session(runtime, folder, role).run(tensor, role["output"]["name"])[0]
        return (got - norm.mean) / norm.std

    clips, images = manifest["encode"], manifest.get("encode_image", manifest["encode"])
    worst["encode"] = error(encode(clips, golden["frames"]), golden["latents"])
    worst["image"] = error(encode(images, golden["image_frame"]), golden["image_encoded"])
    if images is not clips:
        mistake = error(encode(clips, golden["image_frame"]), golden["image_encoded"])
        assert mistake > 2.0, "a mistake would pass: the photograph encoded as a clip"
        worst["least mistake"] = min(worst["least mistake"], mistake)
    role, norm = manifest["decode"], Normalisation(manifest["decode"])
    tensor = {role["input"]["name"]: ((golden["latents_in"] * norm.std + norm.mean)[None], role["input"]["dtype"])}
    got = feed.Session(runtime, folder, role).run(tensor, role["output"]["name"])[0]
    assert got.shape == tuple(golden["decoded_shape"])
    got = ((got - norm.low) / (norm.high - norm.low))[tuple(golden["decoded_at"].T)]
    worst["decode"] = error(got, golden["decoded"])
    return worst


def shown(session, tensors, right, output, golden):
    """The least that any mistake in any input moves the answer, as a part of the tolerance."""
    least = np.inf
    for what, wrong in feed.mistakes(tensors):
        try:
            moved = np.abs(session.run(wrong, output) - right) / (1.0 + np.abs(right))
        except Exception as refused:  # sizes that do not fit are refused: that shows too
            assert "Non-zero status" in str(refused), refused
            continue
        moved = moved.max() / golden["tolerance"]
        assert moved > 2.0, f"a mistake would pass: {what}"
        least = min(least, moved)
    return least


def make(name, folder, runtime):
    """One model's folder; returns a line that says what was found."""
    model = facts.MODELS[name]
    real = (REPOSITORY / "assets/models" / name / "model.toml").read_text()
    manifest = tomllib.loads(derive(real, name, model, {}))
    rng = np.random.RandomState(zlib.crc32(name.encode()))  # its numbers never change between versions of numpy
    prompt, negative = embeddings_of(manifest, rng)
    latent = manifest["latent"]
    codec = Codec(latent["channels"], latent["spatial"], latent["temporal"], rng)
    network = Network(manifest, prompt, rng)
    folder.mkdir(parents=True, exist_ok=True)
    hashes = {}
    graphs = dict(encode=[codec.encode_graph(manifest["encode"])], decode=[codec.decode_graph(manifest["decode"])])
    if "encode_image" in manifest:
        graphs["encode_image"] = [codec.encode_image_graph(manifest["encode_image"])]
    graphs["velocity"] = network.graphs()
    for role, list_ in graphs.items():
        for entry, graph in zip(manifest[role]["graphs"], list_, strict=True):
            hashes.update(graph.save(folder / entry["file"], external="data" in entry))
    text = derive(real, name, model, hashes)
    (folder / "model.toml").write_text(text)
    manifest = tomllib.loads(text)
    compare(tomllib.loads(real), tomllib.loads(text))
    write_npz(folder / manifest["velocity"]["embeddings"], prompt)
    if negative is not None:
        write_npz(folder / manifest["velocity"]["negative"], negative)
    golden, sample = goldens(name, model, manifest, codec, network, prompt, negative, rng)
    write_npz(folder / "golden.npz", golden)
    size = sum(f.stat().st_size for f in folder.iterdir())
    line = f"{name:18} {size / 1024:5.1f} KB"
    if runtime is None:
        return line
    worst = run(runtime, folder, manifest, golden, sample, prompt, negative)
    mistake = worst.pop("least mistake")
    assert max(worst.values()) <= 1.0, f"{name}: the graphs differ from numpy: {worst}"
    errors = ", ".join(f"{k} {v:.2f}" for k, v in worst.items())
    return f"{line}  error / tolerance: {errors}; least mistake {mistake:.0f}"


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("names", nargs="*", metavar="NAME", help="models; all if none is named")
    arguments.add_argument("--out", type=Path, default=REPOSITORY / "tests/models")
    arguments.add_argument("--check", action="store_true")
    options = arguments.parse_args()
    unknown = set(options.names) - set(facts.MODELS)
    if unknown:
        arguments.error(f"unknown: {', '.join(sorted(unknown))}; known: {', '.join(facts.MODELS)}")
    try:
        import onnxruntime as runtime
    except ImportError:
        runtime = None
        print("onnxruntime is not installed: the graphs are written but not run")
    failed = False
    for name in options.names or facts.MODELS:
        if not options.check:
            print(make(name, options.out / name, runtime))
            continue
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            line = make(name, folder, runtime)
            read = lambda where: {f.name: f.read_bytes() for f in where.iterdir()} if where.is_dir() else {}
            new, old = read(folder), read(options.out / name)
            differing = sorted(f for f in new.keys() | old.keys() if new.get(f) != old.get(f))
            failed |= bool(differing)
            print(line, "same" if not differing else "DIFFERENT: " + ", ".join(differing))
    sys.exit(failed)


if __name__ == "__main__":
    main()
