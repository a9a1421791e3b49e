//! Manifest text to data: header, latents, chunks, codecs and files. Opens no file.

use toml::de::DeTable;

use super::keys::{Found, Item, Keys, ManifestErrors};
use super::velocity::velocity;
use super::{
    ChunkSpec, CodecSpec, Direction, Dtype, FileSpec, FirstLatent, GraphSpec, LatentSpec, Layout, Load, Manifest,
    RoleSpec, TensorSpec,
};

/// Most of what a TOML parser complains about after its first slip is a guess.
const SYNTAX_PROBLEMS: usize = 3;

const LAYOUTS: [(&str, Layout); 3] = [("BCTHW", Layout::Bcthw), ("BTCHW", Layout::Btchw), ("BNC", Layout::Bnc)];
const DTYPES: [(&str, Dtype); 6] = [
    ("f32", Dtype::F32),
    ("f16", Dtype::F16),
    ("bf16", Dtype::Bf16),
    ("i64", Dtype::I64),
    ("i32", Dtype::I32),
    ("bool", Dtype::Bool),
];

pub(super) fn parse(text: &str, file: &str) -> Result<Manifest, ManifestErrors> {
    let found = Found::default();
    let (document, syntax) = DeTable::parse_recoverable(text);
    for error in syntax.iter().take(SYNTAX_PROBLEMS) {
        let span = error.span().unwrap_or(text.len()..text.len());
        found.add(span, "", format!("not valid TOML: {}", error.message().trim().replace('\n', ", ")));
    }
    let manifest = if syntax.is_empty() { read(Keys::root(&document, &found)) } else { None };
    match (found.into_errors(text, file), manifest) {
        (None, Some(manifest)) => Ok(manifest),
        (Some(errors), _) => Err(errors),
        // Every reader that gives nothing has said why.
        (None, None) => Err(ManifestErrors { file: file.to_owned(), problems: Vec::new() }),
    }
}

fn read(mut keys: Keys<'_>) -> Option<Manifest> {
    let schema = keys.need("schema").and_then(|i| i.whole(1..=1));
    let name = keys.need("name").and_then(|i| i.text());
    let optional = |keys: &mut Keys<'_>, key| keys.get(key).and_then(|i| i.text()).unwrap_or_default();
    let description = optional(&mut keys, "description");
    let licence = optional(&mut keys, "licence");
    let obtain = optional(&mut keys, "obtain");
    let latent = keys.need("latent").and_then(|i| i.table()).and_then(latent);
    let chunk_item = keys.need("chunk");
    let temporal = latent.as_ref().map(|l| l.temporal);
    let chunk = chunk_item.and_then(|i| i.table()).and_then(|k| chunk(k, temporal));
    let channels = latent.as_ref().map(|l| l.channels);
    let encode = keys.get("encode").map(|i| i.table().and_then(|k| codec(k, channels, true)));
    let image_item = keys.get("encode_image");
    if let (Some(item), None) = (&image_item, &encode) {
        item.problem("serves beside `encode`, which is not there");
    }
    let encode_image = image_item.map(|i| i.table().and_then(|k| codec(k, channels, true)));
    let decode = keys.get("decode").map(|i| i.table().and_then(|k| codec(k, channels, false)));
    let velocity_item = keys.get("velocity");
    let velocity = velocity_item.map(|i| i.table().and_then(|k| velocity(k, latent.as_ref(), chunk.as_ref())));
    if encode.is_none() && decode.is_none() && velocity.is_none() {
        keys.problem("a model has at least one of `encode`, `velocity` and `decode`");
    }
    schema?;
    Some(Manifest {
        folder: Default::default(),
        name: name?,
        description,
        licence,
        obtain,
        latent: latent?,
        chunk: chunk?,
        encode: all_or_nothing(encode)?,
        encode_image: all_or_nothing(encode_image)?,
        decode: all_or_nothing(decode)?,
        velocity: all_or_nothing(velocity)?,
    })
}

// A table that is there must be whole.
fn all_or_nothing<T>(value: Option<Option<T>>) -> Option<Option<T>> {
    match value {
        None => Some(None),
        Some(None) => None,
        whole => whole.map(Some).unwrap_or(None),
    }
}

fn latent(mut keys: Keys<'_>) -> Option<LatentSpec> {
    let channels = keys.need("channels").and_then(|i| i.size(1..=4096));
    let spatial = keys.need("spatial").and_then(|i| i.size(1..=256));
    let temporal = keys.need("temporal").and_then(|i| i.size(1..=64));
    let choices =
        [("generated", FirstLatent::Generated), ("clamped", FirstLatent::Clamped), ("separate", FirstLatent::Separate)];
    let first = keys.get("first").map_or(Some(FirstLatent::Generated), |i| i.choice(&choices));
    let multiple = keys.get("multiple").map_or(Some(1), |i| i.size(1..=256));
    let size = keys.get("size").map(|i| {
        let sizes = i.exactly::<_, 2>(i.sizes(1..=8192));
        if let (Some(sizes), Some(multiple)) = (sizes, multiple)
            && sizes.iter().any(|s| s % multiple != 0)
        {
            i.problem(format!("must be multiples of `multiple`, {multiple}"));
        }
        sizes
    });
    Some(LatentSpec {
        channels: channels?,
        spatial: spatial?,
        temporal: temporal?,
        first: first?,
        multiple: multiple?,
        size: all_or_nothing(size)?,
    })
}

fn chunk(mut keys: Keys<'_>, temporal: Option<usize>) -> Option<ChunkSpec> {
    let item = keys.need("frames");
    let frames = item.as_ref().and_then(|i| i.size(2..=100_000));
    if let (Some(item), Some(frames), Some(temporal)) = (item, frames, temporal)
        && (frames - 1) % temporal != 0
    {
        item.problem(format!("must be 1 + a multiple of latent.temporal, {temporal}; is {frames}"));
    }
    let fixed = keys.get("fixed").map_or(Some(false), |i| i.flag());
    let choices = [("forward", Direction::Forward), ("backward", Direction::Backward)];
    let direction = keys.get("direction").map_or(Some(Direction::Forward), |i| i.choice(&choices));
    let history = keys.get("history").map_or(Some(0), |i| i.size(0..=10_000));
    let item = keys.get("history_includes_first");
    let includes = item.as_ref().map_or(Some(false), Item::flag);
    if let (Some(item), Some(true), Some(Direction::Backward)) = (item, includes, direction) {
        item.problem("a backward model has no image among what follows");
    }
    Some(ChunkSpec {
        frames: frames?,
        fixed: fixed?,
        direction: direction?,
        history: history?,
        history_includes_first: includes?,
    })
}

/// `load`, `memory` and `graphs` of a role.
pub(super) fn role(keys: &mut Keys<'_>) -> Option<RoleSpec> {
    let choices = [("together", Load::Together), ("in_turn", Load::InTurn)];
    let load = keys.get("load").map_or(Some(Load::Together), |i| i.choice(&choices));
    let memory = keys.get("memory").map_or(Some(0), |i| i.whole(0..=1 << 50));
    let graphs = keys.need("graphs").and_then(|i| {
        let list = i.list()?;
        if list.is_empty() {
            i.problem("is empty");
        }
        list.iter().map(|i| i.table().and_then(graph)).collect::<Option<Vec<_>>>()
    });
    let memory = memory?;
    Some(RoleSpec { load: load?, memory: (memory > 0).then_some(memory), graphs: graphs? })
}

fn graph(mut keys: Keys<'_>) -> Option<GraphSpec> {
    let file = file(&mut keys);
    let data = keys.get("data").map_or(Some(Vec::new()), |i| {
        i.list()?.iter().map(|i| i.table().and_then(|mut k| self::file(&mut k))).collect()
    });
    Some(GraphSpec { file: file?, data: data? })
}

fn file(keys: &mut Keys<'_>) -> Option<FileSpec> {
    let name = keys.need("file").and_then(|i| path(&i));
    let sha256 = keys.get("sha256").map(|i| {
        let text = i.text()?.to_ascii_lowercase();
        let hexadecimal = text.len() == 64 && text.bytes().all(|b| b.is_ascii_hexdigit());
        if !hexadecimal {
            i.problem("is not a SHA-256: 64 hexadecimal digits");
        }
        hexadecimal.then_some(text)
    });
    Some(FileSpec { file: name?, sha256: all_or_nothing(sha256)? })
}

/// A path inside the model folder.
pub(super) fn path(item: &Item<'_>) -> Option<String> {
    let text = item.text()?;
    let inside = crate::files::stays_inside(&text);
    if !inside {
        item.problem("must be a path inside the model's folder, without `..`");
    }
    inside.then_some(text)
}

/// `name`, `layout` and `dtype` of a tensor.
pub(super) fn tensor(mut keys: Keys<'_>) -> Option<TensorSpec> {
    let name = keys.need("name").and_then(|i| i.text());
    let layout = layout(&mut keys);
    let dtype = dtype(&mut keys);
    Some(TensorSpec { name: name?, layout: layout?, dtype: dtype? })
}

pub(super) fn layout(keys: &mut Keys<'_>) -> Option<Layout> {
    keys.get("layout").map_or(Some(Layout::Bcthw), |i| i.choice(&LAYOUTS))
}

pub(super) fn dtype(keys: &mut Keys<'_>) -> Option<Dtype> {
    keys.get("dtype").map_or(Some(Dtype::F32), |i| i.choice(&DTYPES))
}

/// A tensor of latents or frames, whose numbers are floats.
pub(super) fn float_tensor(item: Item<'_>) -> Option<TensorSpec> {
    let tensor = tensor(item.table()?)?;
    if matches!(tensor.dtype, Dtype::I64 | Dtype::I32 | Dtype::Bool) {
        item.problem(format!("latents, frames and predictions are floats, not {}", tensor.dtype.name()));
        return None;
    }
    Some(tensor)
}

fn codec(mut keys: Keys<'_>, channels: Option<usize>, encodes: bool) -> Option<CodecSpec> {
    let role = role(&mut keys);
    let mut side = |key: &'static str, frames: bool| {
        let item = keys.need(key)?;
        let tensor = float_tensor(item.clone())?;
        if frames && tensor.layout == Layout::Bnc {
            item.problem("frames have no layout BNC");
        }
        Some(tensor)
    };
    let input = side("input", encodes);
    let output = side("output", !encodes);
    let colours = colours(&mut keys);
    let latents = latent_scale(&mut keys, channels);
    let (colour_mean, colour_std) = colours?;
    let (latent_mean, latent_std) = latents?;
    Some(CodecSpec { role: role?, input: input?, output: output?, colour_mean, colour_std, latent_mean, latent_std })
}

fn colours(keys: &mut Keys<'_>) -> Option<([f64; 3], [f64; 3])> {
    let (range, mean, std) = (keys.get("range"), keys.get("mean"), keys.get("std"));
    if let (Some(range), true) = (&range, mean.is_some() || std.is_some()) {
        range.problem("`range` excludes `mean` and `std`");
        return None;
    }
    if mean.is_some() || std.is_some() {
        let mean = mean.map_or(Some([0.0; 3]), |i| i.exactly(i.numbers()));
        let std = std.map_or(Some([1.0; 3]), |i| {
            let std = i.exactly::<_, 3>(i.numbers())?;
            let positive = std.iter().all(|&s| s > 0.0);
            if !positive {
                i.problem("must be greater than 0");
            }
            positive.then_some(std)
        });
        return Some((mean?, std?));
    }
    let [low, high] = range.map_or(Some([-1.0, 1.0]), |i| {
        let [low, high] = i.exactly::<_, 2>(i.numbers())?;
        if low >= high {
            i.problem("must be [what black becomes, what white becomes], the first below the second");
        }
        (low < high).then_some([low, high])
    })?;
    Some(([-low / (high - low); 3], [1.0 / (high - low); 3]))
}

fn latent_scale(keys: &mut Keys<'_>, channels: Option<usize>) -> Option<(Vec<f64>, Vec<f64>)> {
    let per_channel = |item: Item<'_>| {
        let values = if item.is_list() { item.numbers()? } else { vec![item.number()?] };
        let channels = channels?;
        match values.len() {
            1 if !item.is_list() => Some(vec![values[0]; channels]),
            n if n == channels => Some(values),
            n => {
                item.problem(format!("must have {channels} entries, one a channel of the latent; has {n}"));
                None
            }
        }
    };
    let ones = |value: f64| channels.map(|n| vec![value; n]);
    let mean = keys.get("latent_mean").map_or(ones(0.0), per_channel);
    let (std_item, scale_item) = (keys.get("latent_std"), keys.get("latent_scale"));
    let std = match (std_item, scale_item) {
        (Some(_), Some(scale)) => {
            scale.problem("`latent_scale` excludes `latent_std`");
            None
        }
        (None, None) => ones(1.0),
        (Some(item), None) => positive(&item, per_channel(item.clone())),
        (None, Some(item)) => {
            positive(&item, per_channel(item.clone())).map(|s| s.into_iter().map(|s| 1.0 / s).collect())
        }
    };
    Some((mean?, std?))
}

fn positive(item: &Item<'_>, values: Option<Vec<f64>>) -> Option<Vec<f64>> {
    let values = values?;
    if values.iter().all(|&v| v > 0.0) {
        return Some(values);
    }
    item.problem("must be greater than 0");
    None
}
