//! The whole chain on the shipped photograph of an aloe.

use glam::Vec3;

use super::*;
use crate::scene::Thickness;

const LEAVES: u8 = 1;
const POT: u8 = 2;
const FOCAL: f32 = 3740.0;
const BASELINE: f32 = 0.160;
const OFFSET: f32 = 270.0;
/// The rule of the demo scene.
const RULE: Thickness = Thickness::Inflate { scale: 1.0, min: 0.006, max: 0.014 };

fn aloe() -> PhotoData {
    let open = |name: &str| {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/images/aloe/");
        image::open(format!("{folder}{name}")).unwrap()
    };
    let rgb = open("aloe.jpg").to_rgb8();
    let disparity = open("aloe_disparity.png").to_luma8();
    let metres = |d: &u8| if *d == 0 { 0.0 } else { FOCAL * BASELINE / (f32::from(*d) + OFFSET) };
    PhotoData {
        width: rgb.width(),
        height: rgb.height(),
        labels: open("aloe_objects.png").to_luma8().into_raw(),
        depth: disparity.as_raw().iter().map(metres).collect(),
        focal_px: FOCAL,
        principal: [rgb.width() as f32 / 2.0, rgb.height() as f32 / 2.0],
        rgb: rgb.pixels().map(|p| p.0).collect(),
    }
}

struct Chain {
    photo: PhotoData,
    map: SurfaceMap,
    thick: Vec<f32>,
    world: WorldFromCamera,
}

fn chain() -> Chain {
    let full = aloe();
    let plane = find_ground(&full, &[LEAVES, POT], None, 0).unwrap();
    let world = WorldFromCamera::new(plane.normal, plane.height).unwrap();
    let photo = full.resample(640).unwrap();
    let map = smooth(&photo, &[LEAVES, POT], &Smoothing::integer_disparity(FOCAL, BASELINE, 1.0)).unwrap();
    let thick = thickness(&map, LEAVES, RULE);
    Chain { photo, map, thick, world }
}

#[test]
fn the_ground_is_the_table_and_not_the_backdrop() {
    let full = aloe();
    for seed in 0..5 {
        let plane = find_ground(&full, &[LEAVES, POT], None, seed).unwrap();
        // The camera is level, and the table measured by hand is 0.223 m below it at rows 1,045 to 1,090.
        assert!(plane.normal.dot(Vec3::NEG_Y) > 0.999, "seed {seed}: {}", plane.normal);
        assert!((plane.height - 0.223).abs() < 0.02, "seed {seed}: {}", plane.height);
        let at_pot = (-plane.height - plane.normal.z * 1.55) / plane.normal.y;
        assert!((at_pot - 0.223).abs() < 0.003, "seed {seed}: {at_pot}");
    }
}

#[test]
fn leaves_are_smooth_inside_and_apart_at_their_edges() {
    let Chain { photo, map, .. } = chain();
    let step = 1.0 / (FOCAL * BASELINE);
    // Second differences along rows, in disparity steps: terraces are pairs of ±1, a smooth leaf has next to none.
    let roughness = |depth: &[f32]| {
        let (mut sum, mut count) = (0.0_f64, 0.0_f64);
        for k in 1..depth.len() - 1 {
            let known = photo.depth[k - 1] > 0.0 && photo.depth[k] > 0.0 && photo.depth[k + 1] > 0.0;
            if map.labels[k] == LEAVES && map.linked(k - 1, k) && map.linked(k, k + 1) && known {
                let bend = 1.0 / depth[k - 1] - 2.0 / depth[k] + 1.0 / depth[k + 1];
                sum += f64::from(bend / step).powi(2);
                count += 1.0;
            }
        }
        (sum / count).sqrt()
    };
    let (before, after) = (roughness(&photo.depth), roughness(&map.depth));
    assert!(after < 0.25 * before, "{before} -> {after}");
    // Nothing measured moved by more than half a step and the rounding of kinks, and speckles are under 2 %.
    let moved = (0..map.depth.len())
        .filter(|&k| map.labels[k] != 0 && photo.depth[k] > 0.0)
        .filter(|&k| (1.0 / map.depth[k] - 1.0 / photo.depth[k]).abs() > 0.8 * step)
        .count();
    assert!(100 * moved < 2 * map.labels.iter().filter(|&&l| l != 0).count(), "{moved}");
    // Leaves that overlap inside the mask keep the jump between them.
    let jumps = (0..map.depth.len() - 1)
        .filter(|&k| map.labels[k] == LEAVES && map.labels[k + 1] == LEAVES && !map.linked(k, k + 1))
        .count();
    assert!(jumps > 100, "{jumps}");
    assert!(map.depth.iter().zip(&map.labels).all(|(&z, &l)| (l == 0) == (z == 0.0)));
}

#[test]
fn leaves_become_a_few_thousand_particles_above_the_table() {
    let Chain { photo, map, thick, world } = chain();
    let lattice = Lattice::new(1.0 / 128.0, 8).unwrap();
    let body = MaskBody::new(&map, LEAVES, &thick, &photo.rgb, &world).unwrap();
    let particles = lattice.fill_mask("leaves", &body).unwrap();
    let count = particles.positions.len();
    // Area 0.039 m² at 6 to 14 mm gives 4 to 9 thousand; thin inclined parts are made one layer thick.
    assert!((4000..12000).contains(&count), "{count}");
    let predicted = lattice.predict_count(body.volume());
    assert!((predicted as f64 / count as f64 - 1.0).abs() < 0.25, "{predicted} predicted, {count} made");
    for p in &particles.positions {
        assert!(p[2] > -0.01 && p[2] < 0.47 && p[1] > 1.1 && p[1] < 1.8 && p[0].abs() < 0.35, "{p:?}");
    }
    let points = display_points(&map, LEAVES, &photo.rgb, surface_point(&map, &world)).unwrap();
    let carriers = attach(&points.positions, &particles.positions, lattice.spacing).unwrap();
    // Almost every pixel lies on its body, the nearest particle within two spacings; whiskers are shaved off tips.
    let far = points
        .positions
        .iter()
        .zip(&carriers)
        .filter(|(x, c)| {
            Vec3::from(**x).distance(Vec3::from(particles.positions[c.particle[0] as usize])) > 2.0 * lattice.spacing
        })
        .count();
    assert!(far * 1000 < 15 * points.positions.len(), "{far} of {}", points.positions.len());
}
