//! Negative controls: each of these mistakes, written into a copy of the kernels, must be caught by the harness.

use std::path::Path;

use physvideo_gpu::{Gpu, Options};
use physvideo_tests::proof::harness::{prove, repeat};
use physvideo_tests::proof::{Ask, find};
use physvideo_tests::{device, folder};

/// Kernel whose proof must fail, file, what stands there, what is put in its place.
const MUTANTS: [(&str, &str, &str, &str); 45] = [
    ("cells/clear", "cells/clear", "group.x >= grid.capacity", "group.x >= grid.capacity + 1u"),
    ("cells/locate", "lib/grid", "vec3f(0.5)", "vec3f(0.45)"),
    ("cells/locate", "lib/claim", "!finite(v) || ", ""),
    ("cells/count", "cells/count", "i >= clock.particles", "i > clock.particles"),
    ("cells/range", "cells/range", "lane < 8u", "lane < 7u"),
    ("cells/place", "cells/place", "+ word(ranks, p)", "+ 0u * word(ranks, p)"),
    ("cells/place", "cells/place", "keys.d[p] = cell;", ""),
    ("cells/range", "cells/range", "held + atomicAdd", "0u * held + atomicAdd"),
    ("cells/range", "lib/tick", "clock.t += clock.dt;", ""),
    ("cells/range", "cells/range", "if (lane == 0u) { atomicAdd(&live.overflow, 1u); }", ""),
    (
        "mpm/clock",
        "lib/tick",
        "min(atomicExchange(&clock.speed_bits, 0u), 0x7f7fffffu)",
        "atomicExchange(&clock.speed_bits, 0u)",
    ),
    ("mpm/p2g", "lib/bspline", "0.75 - b * b", "0.75001 - b * b"),
    ("mpm/p2g", "lib/scatter", "4.0 * sx", "3.999 * sx"),
    ("mpm/p2g_fixed", "mpm/p2g_fixed", "vec4i(round(x))", "vec4i(x - 0.5)"),
    ("mpm/p2g_float", "mpm/p2g_float", "if (step <= run)", "if (true)"),
    ("mpm/p2g", "mpm/p2g", "order.d[j - step] > p", "order.d[j - step] < p"),
    ("mpm/p2g", "field/point", "2.0 * f.p0", "1.99 * f.p0"),
    ("mpm/grid", "lib/collider", "rotate(hit.xyz, axis, rate", "rotate(hit.xyz, axis, -rate"),
    ("mpm/grid", "shape/box", "q.x >= q.y && q.x >= q.z", "q.x >= q.y"),
    ("mpm/grid", "lib/node", "if (!finite(v)) {", "if (false) {"),
    ("mpm/grid_rows", "mpm/grid_rows", "n1 += texel(shares, at + 45u)", "n1 += texel(shares, at + 36u)"),
    ("cells/link", "cells/link", "lane < 8u", "lane < 7u"),
    ("cells/link", "cells/link", "min(live.blocks, grid.capacity), lane < 8u", "grid.capacity, lane < 8u"),
    ("mpm/grid", "lib/forget", "table.d[block] = EMPTY;", ""),
    ("mpm/grid_rows", "mpm/grid_rows", "counts.d[slot * 16u + lane]", "counts.d[slot * 16u]"),
    ("mpm/g2p", "mpm/g2p", "if (key != NOWHERE) { claim(key >> 6u); }", ""),
    ("mpm/g2p", "mpm/g2p", "select(0u, QUARANTINED, gone)", "select(0u, QUARANTINED, lost)"),
    ("mpm/g2p", "mpm/g2p", "cell_key(there, s.v)", "cell_key(x, s.v)"),
    ("mpm/g2p", "material/corotated", "tau = 2.0 * b.mu", "tau = 1.999 * b.mu"),
    ("mpm/g2p", "mpm/g2p", "z.g.z * c.v", "z.g.y * c.v"),
    ("mpm/g2p", "mpm/g2p", "FOLLOW * (packed - next)", "0.09 * (packed - next)"),
    ("mpm/g2p", "mpm/g2p", "first + id.x", "id.x"),
    ("mpm/g2p", "mpm/g2p", "!finite(trial.f[0] + trial.f[1] + trial.f[2]) ||", ""),
    ("mpm/g2p", "material/plastic", "0.66666667 * b.p.y", "0.6 * b.p.y"),
    ("mpm/g2p", "material/plastic", "t.memory + 0.81649658 * flow", "t.memory + flow"),
    ("mpm/g2p", "material/snow", "1.0 + b.p.y", "1.0 + b.p.x"),
    ("mpm/g2p", "material/snow", "b.p.z * (1.0 - volume)", "b.p.z * (1.0 - j)"),
    ("mpm/g2p", "material/sand", "strain.x + strain.y + strain.z;", "strain.x + strain.y + strain.z - t.memory;"),
    ("mpm/g2p", "material/sand", "3.0 * b.lambda + 2.0 * b.mu", "2.0 * b.lambda + 2.0 * b.mu"),
    ("mpm/g2p", "material/liquid", "(2.0 / 3.0)", "0.5"),
    ("mpm/measure", "material/liquid", "/ (gamma - 1.0)", "/ gamma"),
    ("mpm/g2p", "lib/svd", "cross(u0, u1)", "cross(u1, u0)"),
    ("mpm/clock", "lib/tick", "clock.runs[i].x = 0u", "clock.runs[0].x = 0u"),
    ("points/carry", "points/carry", "(tag & FLOWS) != 0u", "false"),
    ("mpm/measure", "mpm/measure", "0.5 * dot(momentum, p.v)", "0.49 * dot(momentum, p.v)"),
];

/// The same for what acts on bodies from outside.
const EFFECTS: [(&str, &str, &str, &str); 27] = [
    ("mpm/p2g", "field/vortex", "exp(-r / f.p1)", "exp(-r * r / f.p1)"),
    ("mpm/p2g", "field/vortex", "cross(f.a.xyz, x - f.b.xyz)", "cross(x - f.b.xyz, f.a.xyz)"),
    ("mpm/p2g", "field/vortex", "1.0, f.p2 == 0.0", "0.0, f.p2 == 0.0"),
    ("mpm/p2g", "field/damping", "-f.a.xyz * v", "-f.a.x * v"),
    ("mpm/p2g", "field/noise", "let n = low * low + high * high", "let n = low + high"),
    ("mpm/p2g", "lib/hash", "v.w += v.y * v.z", "v.w += v.x * v.z"),
    ("mpm/p2g", "field/noise", "x.z - f.p2", "x.z + f.p2"),
    ("cells/locate", "cells/locate", "word(awake, i)", "i"),
    ("cells/locate", "cells/locate", "clock.particles - clock.idle", "clock.particles"),
    ("cells/count", "cells/count", "word(awake, i)", "i"),
    ("cells/place", "cells/place", "word(awake, i)", "i"),
    ("mpm/clock", "lib/tick", "clock.particles - clock.idle + 63u", "clock.particles + 63u"),
    ("mpm/clock", "lib/tick", " || atomicLoad(&clock.stirred) > 0u", ""),
    ("mpm/g2p", "mpm/g2p", "(PINNED | ASLEEP)", "PINNED"),
    ("mpm/g2p", "mpm/g2p", "(tag & WATCHED) != 0u && ", ""),
    ("mpm/settle", "mpm/settle", "|| (p.tag & ASLEEP) != 0u", ""),
    ("mpm/settle", "mpm/settle", "~(ASLEEP | WATCHED)", "~ASLEEP"),
    ("mpm/measure", "mpm/measure", "(p.tag & DORMANT) != 0u", "false"),
    ("mpm/survey", "mpm/survey", "0x80000000u, 0xffffffffu", "0x80000000u, 0x7fffffffu"),
    ("mpm/survey", "mpm/survey", "word(awake, id.x)", "id.x"),
    ("mpm/survey", "mpm/survey", "low[a], key(-c)", "low[a], key(c)"),
    ("mpm/survey", "mpm/survey", "atomicMax(&extents.d[slot].speed, ", "atomicStore(&extents.d[slot].speed, "),
    ("source/recycle", "source/recycle", "all(x >= low) && all(x <= high)", "all(x >= low)"),
    ("source/recycle", "source/recycle", "(tag & (PINNED | QUARANTINED)) != 0u", "(tag & PINNED) != 0u"),
    ("source/recycle", "source/recycle", "turns.d[p] = turn + 1u;", ""),
    ("source/recycle", "source/recycle", "tag | DORMANT | QUARANTINED", "tag | QUARANTINED"),
    ("source/recycle", "source/recycle", "/ 16777216.0", "/ 33554432.0"),
];

/// The same for steps and energies.
const GUARD: [(&str, &str, &str, &str); 15] = [
    ("mpm/clock", "lib/tick", " - atomicLoad(&clock.left)", ""),
    ("cells/locate", "cells/locate", "finite(head.xyz) && finite(v)", "false"),
    ("mpm/clock", "lib/tick", "LEAST_STEP * clock.frame_length", "0.0"),
    ("mpm/clock", "lib/tick", "clock.stalled = 1u;", ""),
    ("mpm/measure", "mpm/measure", "only.body == EVERY || ", ""),
    ("mpm/measure", "mpm/measure", "dot(body.gravity, p.x)", "body.gravity.z * p.x.z"),
    ("mpm/measure", "mpm/measure", "dot(p.c1.xyz, p.c1.xyz)", "dot(p.c0.xyz, p.c1.xyz)"),
    ("mpm/g2p", "mpm/g2p", "&& volume <= dot(last[0], cross(last[1], last[2]))", ""),
    ("mpm/grid", "lib/work", "select(0u, 1u, was + low < was)", "0u"),
    ("mpm/grid", "lib/work", "was < low", "was > low"),
    ("mpm/grid", "lib/work", "if (clock.dt > 0.0) { count_units(joules); }", "count_units(joules);"),
    ("mpm/grid_rows", "mpm/grid_rows", "v3, n3.w, time", "v3, n2.w, time"),
    ("mpm/receive", "lib/node", "dot(after - v,", "dot(after,"),
    ("source/recycle", "source/recycle", "count_work(-moved.w * before)", "count_work(moved.w * before)"),
    ("source/recycle", "source/recycle", "- dot(gravity, to) - before", "- before"),
];

/// The same for drawing.
const POINTS: [(&str, &str, &str, &str); 23] = [
    ("points/bin_count", "lib/splat", "ceil(s.xy - s.w - vec2f(0.5))", "floor(s.xy - s.w - vec2f(0.5))"),
    ("points/bin_count", "points/bin_count", "group.y * groups.x", "group.y * 2u"),
    ("points/bin_place", "points/bin_place", "at < call.room", "at <= call.room"),
    ("points/bin_range", "points/bin_range", "- mine", "- 0u * mine"),
    ("points/bin_range", "points/bin_range", "first + sums[63] < first", "false"),
    ("points/bind", "points/bind", "cross(c, a)", "cross(a, c)"),
    ("points/bind", "points/bind", "abs(volume) > 1e-6", "true"),
    ("points/blend", "lib/nearest", "b.z == a.z && b.id < a.id", "b.z == a.z && b.id > a.id"),
    ("points/blend", "points/blend", "d.x < d.y", "d.x <= d.y"),
    ("points/blend", "lib/nearest", "hit.z <= limit", "hit.z < limit"),
    ("points/blend", "lib/pixel", "1.0 - weight", "1.001 - weight"),
    ("points/blend", "points/blend", "min(ends.d[tile], call.room)", "ends.d[tile]"),
    ("points/blend_shared", "points/blend_shared", "min(to.zw, vec2i(7))", "min(to.zw, vec2i(6))"),
    ("points/carry", "points/carry", "turned - offset, vec3f", "turned - offset * 0.9999, vec3f"),
    ("points/carry", "points/carry", "(tag & QUARANTINED) != 0u", "false"),
    ("points/compose", "points/compose", "vec3u(127u)", "vec3u(126u)"),
    ("points/nearest32", "points/nearest32", "d.x >= d.y", "d.x > d.y"),
    ("points/nearest64", "points/nearest64", "u64(i);", "u64(screen.points - i);"),
    ("points/project", "lib/splat", "q.z >= c.near", "q.z > c.near"),
    ("points/resolve", "lib/pixel", "max(b.weight, LEAST_WEIGHT)", "max(b.weight, 1e-4)"),
    ("points/uncover", "points/uncover", "smoothstep(0.0, call.full, moved)", "clamp(moved / call.full, 0.0, 1.0)"),
    ("points/unproject", "points/unproject", "/ view.focal.x)", "/ view.focal.y)"),
    ("points/unproject", "points/unproject", "(bitcast<u32>(z) & 0x7f800000u) != 0x7f800000u && ", ""),
];

/// The same for elastic bodies on grids of their own.
const LAGRANGIAN: [(&str, &str, &str, &str); 62] = [
    ("lagrangian/contact", "lagrangian/contact", "x + off, time", "x, time"),
    ("lagrangian/core", "lagrangian/core", "texel(shares_was, to).xyz + sum", "sum"),
    ("lagrangian/core", "lagrangian/core", "area * solid.stiffness * stored", "solid.stiffness * stored"),
    ("lagrangian/core", "lagrangian/core", "0.5 * (last + dt) * power", "dt * power"),
    ("lagrangian/core", "lagrangian/core", "nearest < wide", "nearest < 0.0"),
    ("lagrangian/core", "lagrangian/core", "sqrt(1.5 + 2.5 * firm)", "sqrt(1.0 + 2.5 * firm)"),
    ("lagrangian/force", "lib/stress", "z + sqrt(1.0 + z * z)", "sqrt(1.0 + z * z)"),
    ("lagrangian/force", "lib/stress", "s[1].y += swells;", ""),
    ("lagrangian/thin", "lagrangian/thin", "derivatives(motion, wd)", "derivatives(motion, wc)"),
    ("lagrangian/thin", "lib/stress", "QUICK * thickest / undamped", "0.5 * QUICK * thickest / undamped"),
    ("lagrangian/force", "lib/stress", "fast * fast / j * share", "fast * fast * share"),
    ("lagrangian/force", "lib/shock", "CALM * wave", "0.9 * CALM * wave"),
    ("lagrangian/force", "lib/squash", "(q - 2.0 + k", "(q - 1.999 + k"),
    ("mpm/measure", "lib/squash", "SQUASHED * log(SQUASHED / k)", "0.0"),
    ("lagrangian/contact", "lagrangian/contact", "power += dot(press, vec3f(", "power += 0.0 * dot(press, vec3f("),
    ("lagrangian/contact", "lagrangian/contact", "power + dot(rub, rub_speed)", "power"),
    ("lagrangian/contact", "lib/give", "depth * depth / 6.0", "depth * depth / 5.0"),
    ("lagrangian/contact", "lib/give", "depth - 0.5 * soft, 0.5 / soft", "depth - 0.5 * soft, 0.49 / soft"),
    ("lagrangian/contact", "lib/touch", "(2.0 - most)", "(1.9 - most)"),
    ("lagrangian/advance", "lagrangian/advance", "MEETS && heavy", "MEETS"),
    ("lagrangian/contact", "lagrangian/contact", "fast * fast + solid.stiffness", "fast + solid.stiffness"),
    ("lagrangian/contact", "lib/touch", "min(abs(s), 1.0)", "min(abs(s), 1.1)"),
    ("lagrangian/force", "piola/corotated", "2.0 * b.mu) * e", "1.999 * b.mu) * e"),
    ("lagrangian/force", "piola/neo_hookean", "vec4f(LEAST_VOLUME));", "vec4f(0.06));"),
    ("lagrangian/force", "lagrangian/force", "0.6875 * n.m + 0.15625", "0.6875 * n.m + 0.15615"),
    ("lagrangian/force", "lagrangian/force", "Three(s - d, 0.6875", "Three(s + d, 0.6875"),
    ("lagrangian/force", "lagrangian/force", "Three(d - s, -2.0 * d, d + s)", "Three(d - s, -2.001 * d, d + s)"),
    ("lagrangian/force", "lagrangian/force", "corner ^ 2u, 2u", "corner ^ 1u, 2u"),
    ("lagrangian/force", "lagrangian/force", "(1u << corner) - 1u", "(2u << corner) - 1u"),
    ("lagrangian/force", "lib/stress", "!(size <= vec4f(MOST_STRETCH))", "(size > vec4f(MOST_STRETCH))"),
    ("lagrangian/force", "lib/reference", "- 2.0);", "- 1.9);"),
    ("lagrangian/force", "lagrangian/force", "i >= select(", "i > select("),
    ("lagrangian/force", "lagrangian/force", "reference.touched, 0u, PUSHED", "0u, 0u, PUSHED"),
    ("lagrangian/force", "lagrangian/force", "let to = last.w;", "let to = i;"),
    ("lagrangian/force", "lib/polar", "1e-4 * s", "0.5 * s"),
    ("lagrangian/force", "lib/polar", "k < 12", "k < 3"),
    ("lagrangian/advance", "lagrangian/advance", "MIRRORED && ", "false && "),
    (
        "lagrangian/thin",
        "lagrangian/thin",
        "vec2f(w.gy.y * w.wz.x, w.wy.y * w.gz.x)",
        "vec2f(w.gy.y * w.wz.x, w.wy.x * w.gz.x)",
    ),
    ("lagrangian/thin", "lib/rows", "w.gz.x * l.v + w.gz.y * m.v", "w.gz.x * l.v + w.wz.y * m.v"),
    ("lagrangian/bend", "lib/rows", "w.gy.x * p.v", "w.wy.x * p.v"),
    ("lagrangian/bend", "lagrangian/bend", "place.w * stored(", "stored("),
    ("lagrangian/bend", "lagrangian/bend", "sum -= stored(", "sum += stored("),
    ("lagrangian/bend", "lagrangian/bend", "vec3u(1u, 2u, 4u)", "vec3u(1u, 4u, 2u)"),
    ("lagrangian/thin", "lagrangian/thin", "thin.y + i + 2u", "thin.y + i + 1u"),
    ("lagrangian/thin", "lagrangian/thin", "vec4f(was.m + r.m, 0.0)", "vec4f(r.m, 0.0)"),
    ("lagrangian/thin", "lib/stress", "share > vec4f(0.0)", "share >= vec4f(0.0)"),
    ("lagrangian/advance", "lagrangian/advance", "0.5 * (last.w + dt)", "dt"),
    ("lagrangian/advance", "lagrangian/advance", "f -= gather(more.y)", "f += gather(more.y)"),
    ("lagrangian/advance", "lagrangian/advance", "from_row(b.y, 15u)", "from_row(b.y, 12u)"),
    ("lagrangian/advance", "lagrangian/advance", "first + below + at, row & 4u", "first + at, row & 4u"),
    ("lagrangian/advance", "lagrangian/advance", "if (!finite(was + dt * now)) {", "if (false) {"),
    ("lagrangian/advance", "lagrangian/advance", "vec4f(-moved, 0.0)", "vec4f(moved, 0.0)"),
    ("lagrangian/advance", "lagrangian/advance", "forced && speed > most", "forced && speed > 1.1 * most"),
    ("lagrangian/sample", "lib/reference", "WEIGHT.zyx, WEIGHT, upper.y", "WEIGHT, WEIGHT.zyx, upper.y"),
    ("lagrangian/sample", "lagrangian/sample", "transpose(gradient)", "gradient"),
    ("lagrangian/sample", "lagrangian/sample", "point == NOBODY", "false"),
    ("lagrangian/contact", "lagrangian/contact", "moved.zz / 32.0", "moved.zz / 16.0"),
    ("lagrangian/contact", "lagrangian/contact", "c.friction * normal", "0.99 * c.friction * normal"),
    ("lagrangian/contact", "lagrangian/contact", "if (normal <= firmest)", "if (normal >= firmest)"),
    ("lagrangian/contact", "lib/touch", "select(11u + axis, 8u + axis", "select(8u + axis, 11u + axis"),
    ("lagrangian/contact", "lib/touch", "rotate(hit.xyz, p.axis, p.angle)", "rotate(hit.xyz, p.axis, -p.angle)"),
    ("lagrangian/advance", "lagrangian/advance", "solid.wave) + speed", "solid.wave) + 0.5 * speed"),
];

/// The same for bodies on grids of their own that meet.
const PAIRS: [(&str, &str, &str, &str); 20] = [
    ("lagrangian/surface", "lagrangian/surface", "(0.5 * way * way) * bend", "(way * way) * bend"),
    ("lagrangian/surface", "lagrangian/surface", "last.w, last.w > 0.0)", "last.w, true)"),
    ("lagrangian/surface", "lagrangian/surface", "sqrt(solid.density)", "solid.density"),
    ("lagrangian/surface", "lagrangian/surface", "cof * shape.xyz", "shape.xyz * cof"),
    ("lagrangian/surface", "lagrangian/surface", "k = 1u; k < FACETS", "k = 1u; k < FACETS - 1u"),
    ("lagrangian/surface", "lagrangian/surface", "x - last.xyz, last.w > 0.0", "x - last.xyz, true"),
    ("lagrangian/surface", "lagrangian/surface", "0.5 * tie.xyz + moved", "tie.xyz + moved"),
    ("lagrangian/meet", "lagrangian/meet", "(own.stiffness + other.stiffness)", "(2.0 * own.stiffness)"),
    ("lagrangian/meet", "lagrangian/meet", "min(own.friction, other.friction)", "own.friction"),
    ("lagrangian/meet", "lagrangian/meet", "1.27323954", "1.27423954"),
    ("lagrangian/meet", "lagrangian/meet", "0.5 * stored(", "0.49 * stored("),
    (
        "lagrangian/meet",
        "lib/give",
        "1.0 + LOSS * clamp(closing / wave, -1.0",
        "1.0 + LOSS * clamp(closing / wave, 0.0",
    ),
    ("lagrangian/meet", "lagrangian/meet", "depth < reach", "depth < 1.2 * reach"),
    ("lagrangian/meet", "lagrangian/meet", "own.wave + other.wave", "2.0 * own.wave"),
    ("lagrangian/meet", "lagrangian/meet", "own.damping * other.stiffness", "own.damping * own.stiffness"),
    ("lagrangian/meet", "lagrangian/meet", "(wide * wide * grown)", "(wide * wide)"),
    ("lagrangian/meet", "lagrangian/meet", "slid - dot(slid, n) * n", "slid"),
    ("lagrangian/meet", "lagrangian/meet", "half * 32u", "half * 31u"),
    ("lagrangian/meet", "lagrangian/meet", "apart < reach", "apart < 0.3 * reach"),
    ("lagrangian/meet", "lagrangian/meet", "if (BESIDE)", "if (false)"),
];

/// The same for what those and the matter of a grid do to each other.
const MATTER: [(&str, &str, &str, &str); 18] = [
    ("lagrangian/press", "lagrangian/press", "0.5 * (was.w + dt)", "dt"),
    ("lagrangian/press", "lagrangian/press", "at.z > 3u", "at.z > 4u"),
    ("lagrangian/press", "lagrangian/press", "vec3f(FULLEST * full)", "vec3f(2.1 * full)"),
    ("lagrangian/press", "lagrangian/press", "was.xyz + was.w * rate", "was.xyz + dt * rate"),
    ("lagrangian/press", "lagrangian/press", "slid - dot(slid, n) * n", "slid"),
    ("lagrangian/press", "lagrangian/press", "min(law.y, FRICTION)", "law.y"),
    ("lagrangian/press", "lagrangian/press", "if (BESIDE)", "if (false)"),
    ("lagrangian/press", "lagrangian/press", " && slot < grid.capacity", ""),
    ("lagrangian/press", "lagrangian/press", "max(0.0, fill - bitcast<f32>(law.w))", "fill - bitcast<f32>(law.w)"),
    ("lagrangian/press", "lagrangian/press", "fill > LEAST", "fill > 0.1"),
    ("lagrangian/press", "lagrangian/press", "(law.x + STIFFNESS)", "(law.x + law.x)"),
    ("lagrangian/press", "lagrangian/press", "stored + kick", "kick"),
    ("lagrangian/press", "lagrangian/press", "gz[k] * wy[j] * dot", "gz[k] * wy[k] * dot"),
    ("mpm/receive", "mpm/receive", "if (lane == 0u) { forget(slot, list.d[slot]); }", ""),
    ("mpm/receive", "mpm/receive", "gifts.d[3u * at + a] = 0;", ""),
    ("mpm/receive", "lib/node", "time, CONTACT * grid.dx)", "time, 0.5 * grid.dx)"),
    ("mpm/receive", "mpm/receive", "node(v, was.w, dt)", "vec4f(v, was.w)"),
    ("mpm/grid", "mpm/grid", "FORGETS && ", ""),
];

/// The same for latents.
const LATENT: [(&str, &str, &str, &str); 30] = [
    ("latent/adapt", "latent/adapt", "given.guidance * (p - u)", "given.guidance * (u - p)"),
    ("latent/adapt", "latent/adapt", "+ given.kz * texel(z, i)", "- given.kz * texel(z, i)"),
    ("latent/adapt", "latent/adapt", "given.kp * p", "given.kz * p"),
    ("latent/flow_step", "latent/flow_step", "step += given.b", "step -= given.b"),
    ("latent/flow_step", "latent/flow_step", "next = select(next, old, weights", "next = select(old, next, weights"),
    ("latent/flow_step", "latent/flow_step", "if (HELD)", "if (false)"),
    ("latent/flow_step", "lib/latent", "count >> 2u", "(count >> 2u) + 1u"),
    ("latent/flow_step", "lib/latent", "cell + 1u == cells", "false"),
    ("latent/sde_step", "lib/philox", "0xd2511f53u * c.x", "0xd2511f55u * c.x"),
    ("latent/sde_step", "lib/philox", "0xbb67ae85u", "0xbb67ae84u"),
    ("latent/sde_step", "lib/philox", "c = philox_round(c, key + 5u * weyl);", ""),
    ("latent/sde_step", "lib/philox", "+ (middle >> 16u)", ""),
    ("latent/sde_step", "lib/gaussian", "return -2.0 * (e", "return -1.0 * (e"),
    ("latent/sde_step", "lib/gaussian", "((quarter + 1u) & 2u)", "(quarter & 2u)"),
    ("latent/sde_step", "lib/gaussian", "vec4u(block, iteration, stream, 0u)", "vec4u(block, stream, iteration, 0u)"),
    ("latent/sde_step", "latent/sde_step", "sqrt(d) * noise", "d * noise"),
    ("latent/sde_step", "latent/sde_step", "given.b * texel(v, i)", "-given.b * texel(v, i)"),
    ("latent/sde_step", "latent/sde_step", "given.iteration + 1u", "given.iteration"),
    ("latent/sde_step", "latent/sde_step", "d == vec4f(0.0)", "d == vec4f(2.0)"),
    ("latent/mix", "latent/mix", "(1.0 - given.sigma) * texel", "given.sigma * texel"),
    ("latent/mix", "latent/mix", "m * old + (1.0 - m) * next", "(1.0 - m) * old + m * next"),
    ("latent/mix", "latent/mix", "old, m == vec4f(1.0)", "old, m == vec4f(0.0)"),
    ("latent/mix", "latent/mix", "between, next, m == vec4f(0.0)", "between, between, m == vec4f(0.0)"),
    ("latent/stats", "latent/stats", "apart]); }", "1u]); }"),
    ("latent/stats", "latent/stats", "vec4<bool>(turn.live)", "vec4<bool>(true)"),
    ("latent/stats", "latent/stats", "let good = finite(x) & counts", "let good = counts"),
    ("latent/mask_pool", "latent/mask_pool", "call.temporal * (latent - 1u) + 1u", "call.temporal * (latent - 1u)"),
    ("latent/mask_pool", "latent/mask_pool", "+ 1u - call.first", ""),
    ("latent/mask_pool", "latent/mask_pool", "(x + 1u + call.reach)", "(x + call.reach)"),
    ("latent/mask_pool", "latent/mask_pool", "f32(covered > 0u)", "f32(covered == seen)"),
];

/// The same for liquids.
const SPH: [(&str, &str, &str, &str); 80] = [
    ("sph/pack", "sph/pack", "< p);", "<= p);"),
    ("sph/pack", "sph/pack", "texel(was, 6u * p + 5u)", "texel(was, 6u * p + 4u)"),
    ("sph/pack", "lib/spot", "(q.y & 0x7ffu) << 10u", "(q.y & 0x7ffu) << 11u"),
    ("sph/search", "lib/spot", "d << 22u", "d << 21u"),
    ("sph/search", "lib/spot", "+ OFF", "- 14.0"),
    ("sph/search", "sph/search", "skin == 0.0)", "true)"),
    ("sph/search", "sph/search", "2.0 * h_of() + skin", "2.0 * h_of()"),
    ("sph/clock", "sph/clock", "RECYCLES || opens ||", "RECYCLES ||"),
    ("sph/clock", "sph/clock", "if (made > 0u) { keep.nodes = made; }", ""),
    ("sph/clock", "sph/clock", "0.5 * keep.skin", "keep.skin"),
    ("sph/clock", "lib/keep", "~r, r & 0x7fffffffu", "r, r & 0x7fffffffu"),
    ("sph/advance", "sph/advance", "v - keep.drift", "v"),
    ("sph/advance", "sph/advance", "if (!finite(x)) {", "if (false) {"),
    ("sph/advance", "sph/advance", "warm.d[i] = found;", ""),
    ("sph/search", "sph/search", "(cell.x & 3) == 0", "(cell.x & 3) == 1"),
    ("sph/search", "sph/search", "i32(lead) - shift", "i32(lead) + 1 - shift"),
    ("sph/search", "sph/search", "k < 8u && at", "k < 7u && at"),
    ("sph/density", "lib/sph_kernel", "0.25 * a * a * a - b * b * b", "0.25 * a * a * a - 0.999 * b * b * b"),
    ("sph/density", "sph/density", "g * g / other.w", "g * g"),
    ("sph/density", "sph/density", "select(spline(q), 0.0, j == i)", "spline(q)"),
    ("sph/surround", "lib/wall", "m.slope * free + slope * (", "m.slope + slope * ("),
    ("sph/surround", "lib/wall", "min(across, 0.0)", "across"),
    ("sph/surround", "lib/sph_kernel", "b4 * (0.5 - 0.4 * b)", "b4 * (0.5 - 0.39 * b)"),
    ("sph/surround", "sph/surround", "s3 * s3 * fill - 1.0", "s3 * s3 - 1.0"),
    ("sph/surround", "lib/sph_kernel", "3.0 * r * r * (rub_down", "3.01 * r * r * (rub_down"),
    ("sph/surround", "sph/surround", "full * thick * m.squeeze", "thick * m.squeeze"),
    ("sph/cohesion", "lib/sph_kernel", "- 6.0 * max", "- 5.99 * max"),
    ("sph/cohesion", "sph/cohesion", "2.0 * cube - 1.0", "2.0 * cube"),
    ("sph/cohesion", "sph/cohesion", "- other.tension * other.slope", "- own.tension * other.slope"),
    ("sph/cohesion", "sph/cohesion", "(along - across) * dot(e, step)", "along * dot(e, step)"),
    ("sph/force", "lib/sph_kernel", "1.0200698", "1.0201698"),
    ("sph/force", "sph/force", "(here.w + there.w)", "2.0 * here.w"),
    ("sph/force", "lib/sph", "2.0 * a * b", "a * b"),
    ("sph/force", "lib/sph_kernel", "0.64529452", "0.64629452"),
    ("sph/force", "sph/force", "dot(flow.xyz - other.xyz, e)", "dot(flow.xyz, e)"),
    ("sph/surround", "lib/sph_kernel", "1.1414433", "1.1424433"),
    ("sph/force", "sph/force", "squeezed(own, v - own.slide)", "squeezed(own, v)"),
    ("sph/resist", "sph/resist", "own.slide - motion.xyz", "own.slide"),
    ("sph/resist", "sph/resist", "dt * squeezed(own, motion.xyz) + slowed", "slowed"),
    ("sph/resist", "sph/resist", "shares.d[word(numbers, id.x)]", "shares.d[id.x]"),
    ("sph/total", "sph/total", " && word(keys, p) != NOWHERE", ""),
    ("sph/weigh", "sph/weigh", "turn * all.x / descent.along", "turn * all.x * descent.along"),
    ("sph/descend", "sph/descend", "if (turn != 0.0)", "if (true)"),
    ("sph/source", "sph/source", "own.fill < SPRAY", "false"),
    ("sph/press", "lib/sph", "pressure * own.wall", "2.0 * pressure * own.wall"),
    ("sph/relax", "sph/relax", "select(0.5, 0.4, IMPLICIT)", "0.5"),
    ("sph/relax", "sph/relax", "turn / (turn + 3.0)", "turn / (turn + 2.0)"),
    ("sph/relax", "sph/relax", "a - texel(pushes, j).xyz", "a + texel(pushes, j).xyz"),
    ("sph/judge", "sph/judge", "solve.iterations >= rule.least && ", ""),
    ("sph/advance", "sph/advance", "min(1.0, most", "min(2.0, most"),
    ("sph/advance", "sph/advance", "{ tag &= ~LED; }", "{}"),
    ("sph/advance", "sph/advance", "h_of() / dt", "0.9 * h_of() / dt"),
    ("sph/advance", "sph/advance", "dot(led, led) - dot(v, v)", "dot(led, led)"),
    ("sph/advance", "sph/advance", "max(place.w + stir, 0.0) * rub", "(place.w + stir) * rub"),
    ("sph/surround", "sph/surround", "crowd.fill - debt.noted, debt.noted > 0.0", "crowd.fill - debt.noted, true"),
    ("sph/surround", "sph/surround", "max(over, inside * over)", "over"),
    ("sph/spread", "sph/spread", "1.0 + NEAR * near * near", "1.0 + NEAR * near"),
    ("sph/spread", "sph/spread", "(own.tag & (PINNED | LED)) != 0u", "(own.tag & PINNED) != 0u"),
    ("sph/spread", "sph/spread", "(1.0 - inside_of(steep))", "1.0"),
    ("sph/spread", "sph/spread", "speed * speed / max", "speed / max"),
    ("sph/spread", "sph/spread", "FORGIVEN * clock.wave_speed", "0.5 * FORGIVEN * clock.wave_speed"),
    ("sph/surround", "lib/sph", "smoothstep(0.25, 0.45", "smoothstep(0.2, 0.45"),
    ("sph/adopt", "sph/adopt", "+ length(way) / dt", "+ length(way)"),
    ("sph/surround", "lib/wall", "beside.part * free / left", "free / left"),
    ("sph/surround", "lib/wall", "crowd += alike *", "crowd +="),
    ("sph/surround", "lib/wall", "s.d + 0.5 * beside.lacking", "s.d + beside.lacking"),
    ("sph/surround", "lib/wall", "0.5 * opposed * (dot(", "opposed * (dot("),
    ("sph/surround", "lib/wall", "(grows() + steep) * beside.both", "steep * beside.both"),
    ("sph/surround", "lib/wall", "beside.part * length(slope)", "length(slope)"),
    ("sph/surround", "sph/surround", "near.deepest < -SUNK", "near.deepest < 0.0"),
    ("sph/surround", "sph/surround", "fill -= held * own;", ""),
    ("sph/surround", "sph/surround", "SLUGGISH / (density", "0.9 * SLUGGISH / (density"),
    ("sph/source", "sph/source", "min(own.fill - 1.0, MENDED)", "own.fill - 1.0"),
    ("sph/surround", "lib/wall", "m.power * free + dot(s.speed, lift)", "m.power + dot(s.speed, lift)"),
    ("sph/surround", "sph/surround", "full * m.power", "m.power"),
    ("sph/cohesion", "sph/cohesion", "locals.d[i].power += walls.w;", ""),
    ("sph/force", "sph/force", "dot(v - free, own.slide)", "dot(v, own.slide)"),
    ("sph/advance", "lib/sph", "own.power - pressure * own.drift", "own.power + pressure * own.drift"),
    ("sph/advance", "sph/advance", "own.drag * over + squeezed(own, over)", "own.drag * over"),
    ("sph/advance", "sph/advance", "work -= mass * dot(lost", "work += mass * dot(lost"),
];

/// The first of some sizes and seeds at which a kernel's proof fails, and how.
fn fault(gpu: &Gpu, kernel: &str) -> Option<(Ask, String)> {
    let sizes = [1, 65, 1000].into_iter().flat_map(|items| (0..4).map(move |seed| (items, seed)));
    let mut asks = sizes.flat_map(|(items, seed)| [false, true].map(|poison| Ask { items, seed, poison }));
    asks.find_map(|ask| Some((ask, fails(gpu, kernel, ask)?)))
}

fn fails(gpu: &Gpu, kernel: &str, ask: Ask) -> Option<String> {
    let case = find(kernel).unwrap();
    prove(gpu, case, ask).err().or_else(|| repeat(gpu, case, ask).err())
}

#[test]
fn every_mistake_is_caught() {
    let (copy, intact) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    folder::copy_kernels(intact.path());
    let open = |wgsl: &Path| device::open(Options { wgsl: Some(wgsl.into()), validation: false, ..device::options() });
    let sound = open(intact.path());
    let (mut missed, mut wrong) = (Vec::new(), Vec::new());
    for (kernel, file, from, to) in MUTANTS
        .into_iter()
        .chain(EFFECTS)
        .chain(GUARD)
        .chain(LAGRANGIAN)
        .chain(PAIRS)
        .chain(MATTER)
        .chain(LATENT)
        .chain(POINTS)
        .chain(SPH)
    {
        folder::copy_kernels(copy.path());
        folder::edit(copy.path(), file, from, to);
        match fault(&open(copy.path()), kernel) {
            Some((ask, what)) => {
                println!("{file}: `{to}` caught: {what}");
                // A proof that is wrong by itself catches nothing.
                wrong.extend(fails(&sound, kernel, ask));
            }
            None => missed.push(format!("{file}: `{to}`")),
        }
    }
    assert!(wrong.is_empty(), "proofs that fail without a mistake: {}", wrong.join(", "));
    assert!(missed.is_empty(), "mistakes nobody noticed: {}", missed.join(", "));
}
