//! Tests of the volume filling: counts against known volumes, thin bodies, and messages.

use super::super::mesh::TriangleMesh;
use super::super::unproject::Pinhole;
use super::*;

const GREY: [f32; 3] = [0.5; 3];

fn lattice(spacing: f32) -> Lattice {
    Lattice { spacing }
}

/// The cube [0, 1]³ with its faces cut so that diagonals and edges run through lattice columns.
fn cube() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let vertices = (0..8).map(|k| [k & 1, k >> 1 & 1, k >> 2 & 1].map(|c| c as f32)).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    (vertices, quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect())
}

/// An octahedron refined on to the unit sphere.
fn sphere(rounds: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let mut vertices: Vec<Vec3> = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z].to_vec();
    let mut triangles = vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    for _ in 0..rounds {
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            // Each triangle makes its own middle points: they must be welded.
            let middle = |p: u32, q: u32| (vertices[p as usize] + vertices[q as usize]).normalize();
            let new = [middle(a, b), middle(b, c), middle(c, a)];
            let n = vertices.len() as u32;
            vertices.extend(new);
            finer.extend([[a, n, n + 2], [n, b, n + 1], [n + 2, n + 1, c], [n, n + 1, n + 2]]);
        }
        triangles = finer;
    }
    (vertices.iter().map(|v| v.to_array()).collect(), triangles)
}

#[test]
fn the_lattice_needs_a_cube_of_particles_per_cell() {
    assert_eq!(Lattice::new(1.0 / 128.0, 8).unwrap().spacing, 1.0 / 256.0);
    assert_eq!(Lattice::new(0.3, 27).unwrap().spacing, 0.1);
    assert_eq!(Lattice::new(0.1, 9), Err(GeometryError::NotACube(9)));
    assert!(Lattice::new(0.0, 8).is_err() && Lattice::new(f32::NAN, 8).is_err());
}

#[test]
fn counts_are_predicted_without_allocating() {
    assert_eq!(lattice(0.1).predict_count(1.0), 1000);
    assert!(lattice(1e-4).predict_count(1.0) > 900_000_000_000);
    assert_eq!(lattice(1e-9).predict_count(1e30), u64::MAX);
}

#[test]
fn a_box_is_filled_exactly_and_a_thin_one_keeps_a_layer() {
    let p = lattice(0.125).fill_box("b", [0.0; 3], [1.0, 0.5, 0.25], GREY).unwrap();
    assert_eq!(p.positions.len(), 8 * 4 * 2);
    assert_eq!(p.positions[0], [0.0625; 3]);
    assert_eq!(p.volume, 0.125_f32.powi(3));
    let p = lattice(0.125).fill_box("sheet", [0.0, 0.0, 0.07], [1.0, 1.0, 0.08], GREY).unwrap();
    assert_eq!(p.positions.len(), 64);
    let text = lattice(0.1).fill_box("flat", [0.0; 3], [1.0, 1.0, 0.0], GREY).unwrap_err().to_string();
    assert_eq!(
        text,
        "object 'flat' got no particles: its smallest extent is 0.00e0 m and the particle spacing is 1.00e-1 m; \
         raise `simulation.grid_density` or make the object larger"
    );
}

#[test]
fn a_ball_has_its_volume() {
    let p = lattice(0.04).fill_ball("b", [0.3, -0.2, 0.9], 0.5, GREY).unwrap();
    let want = 4.0 / 3.0 * std::f32::consts::PI * 0.125;
    let got = p.positions.len() as f32 * p.volume;
    assert!((got / want - 1.0).abs() < 0.02, "{got} {want}");
    assert!(matches!(lattice(0.5).fill_ball("b", [0.0; 3], 0.01, GREY), Err(GeometryError::NoParticles { .. })));
}

#[test]
fn meshes_have_their_volume() {
    for (name, (v, t), want) in [("cube", cube(), 1.0), ("sphere", sphere(5), 4.18879)] {
        let mesh = TriangleMesh::new(&v, &t).unwrap();
        assert!((mesh.volume() / want - 1.0).abs() < 0.01, "{name}: {}", mesh.volume());
        let p = lattice(1.0 / 32.0).fill_mesh(name, &mesh, GREY).unwrap();
        let got = p.positions.len() as f64 * f64::from(p.volume);
        // The surface's lattice points are a thousandth; the sphere's facets lose another.
        assert!((got / want - 1.0).abs() < 0.02, "{name}: {got}");
        assert!(p.positions.windows(2).all(|w| w[0] != w[1]), "{name} has a point twice");
    }
}

#[test]
fn columns_through_edges_and_vertices_are_counted_once() {
    // Spacing 2/n puts columns exactly on the cube's faces' diagonals (x = y), and, shifted, on its vertical edges.
    let (mut v, t) = cube();
    let mesh = TriangleMesh::new(&v, &t).unwrap();
    assert_eq!(lattice(0.125).fill_mesh("cube", &mesh, GREY).unwrap().positions.len(), 512);
    for c in v.iter_mut().flatten() {
        *c += 0.0625;
    }
    let mesh = TriangleMesh::new(&v, &t).unwrap();
    assert_eq!(lattice(0.125).fill_mesh("cube", &mesh, GREY).unwrap().positions.len(), 512);
    // Faces turned at random: parity instead of winding.
    let turned: Vec<[u32; 3]> =
        t.iter().enumerate().map(|(i, t)| if i % 3 == 0 { [t[0], t[2], t[1]] } else { *t }).collect();
    let mesh = TriangleMesh::new(&v, &turned).unwrap();
    assert_eq!(lattice(0.125).fill_mesh("cube", &mesh, GREY).unwrap().positions.len(), 512);
}

#[test]
fn overlapping_parts_are_one_body() {
    let (mut v, mut t) = cube();
    let (v2, t2) = cube();
    v.extend(v2.iter().map(|p| [p[0] + 0.5, p[1] + 0.01, p[2]]));
    t.extend(t2.iter().map(|t| t.map(|i| i + 8)));
    let mesh = TriangleMesh::new(&v, &t).unwrap();
    let p = lattice(0.05).fill_mesh("two", &mesh, GREY).unwrap();
    let volume = p.positions.len() as f32 * p.volume;
    assert!((volume - 1.505).abs() < 0.03, "{volume}");
}

#[test]
fn a_broken_mesh_is_named() {
    let (v, mut t) = cube();
    t.remove(0);
    let text = TriangleMesh::new(&v, &t).unwrap_err().to_string();
    assert!(text.starts_with("the mesh is not closed: the edge from vertex 0 [0.0, 0.0, 0.0] to vertex 2"), "{text}");
    assert!(matches!(TriangleMesh::new(&v, &[[0, 1, 99]]), Err(GeometryError::BadIndex { vertex: 99, .. })));
    assert!(matches!(TriangleMesh::new(&[[f32::NAN; 3]], &[]), Err(GeometryError::BadVertex { vertex: 0 })));
    let none = TriangleMesh::new(&[], &[]).unwrap();
    assert!(matches!(lattice(0.1).fill_mesh("none", &none, GREY), Err(GeometryError::NoParticles { .. })));
    // A lid thinner than the lattice stays.
    let (mut v, t) = cube();
    v.iter_mut().for_each(|p| p[2] = 0.04 + 0.001 * p[2]);
    let thin = TriangleMesh::new(&v, &t).unwrap();
    assert_eq!(lattice(0.1).fill_mesh("thin", &thin, GREY).unwrap().positions.len(), 100);
}

/// A 200 × 100 mm plate 1 m away (1 mm a pixel), leaning by `slope` (depth per lateral metre in x).
fn plate(slope: f32) -> SurfaceMap {
    let (w, h) = (240_usize, 140_usize);
    let inside = |k: usize| (20..220).contains(&(k % w)) && (20..120).contains(&(k / w));
    let camera = Pinhole { focal_px: 1000.0, principal: [120.0, 70.0] };
    SurfaceMap {
        width: w as u32,
        height: h as u32,
        camera,
        labels: (0..w * h).map(|k| u8::from(inside(k))).collect(),
        depth: (0..w * h)
            .map(|k| if inside(k) { 1.0 / (1.0 - slope * ((k % w) as f32 + 0.5 - 120.0) / 1000.0) } else { 0.0 })
            .collect(),
        links: (0..w * h)
            .map(|k| {
                u8::from(k + 1 < w * h && inside(k) && inside(k + 1))
                    + 2 * u8::from(k + w < w * h && inside(k) && inside(k + w))
            })
            .collect(),
    }
}

fn count(map: &SurfaceMap, thickness: f32, spacing: f32, world: &WorldFromCamera) -> (Particles, f64) {
    let thick = vec![thickness; map.depth.len()];
    let rgb = vec![[255, 0, 51]; map.depth.len()];
    let body = MaskBody::new(map, 1, &thick, &rgb, world).unwrap();
    (lattice(spacing).fill_mask("plate", &body).unwrap(), body.volume())
}

#[test]
fn a_mask_has_its_volume_in_any_world() {
    for (up, slope) in [(Vec3::NEG_Y, 0.0), (Vec3::NEG_Y, 1.0), (Vec3::new(0.3, -1.0, -0.5), 0.4)] {
        let world = WorldFromCamera::new(up, 0.7).unwrap();
        let map = plate(slope);
        let (p, predicted) = count(&map, 0.03, 0.003, &world);
        let volume = p.positions.len() as f64 * f64::from(p.volume);
        assert!((volume / predicted - 1.0).abs() < 0.02, "{volume} {predicted}");
        if slope == 0.0 {
            // 0.2 × 0.1 × 0.03 m, and 3 % more because the frustum widens behind its front.
            assert!((predicted / 6e-4 - 1.03).abs() < 0.003, "{predicted}");
        }
        let mut sorted = p.positions.clone();
        sorted.sort_by(|a, b| a.partial_cmp(b).unwrap());
        sorted.dedup();
        assert_eq!(sorted.len(), p.positions.len(), "a point twice");
        assert_eq!(p.colors[0], [1.0, 0.0, 0.2]);
        for q in &p.positions {
            let (at, z) = map.camera.project(world.to_camera(Vec3::from(*q))).unwrap();
            let front = map.sample(&map.depth, at).unwrap();
            assert!(z > front - 1e-5 && z < front + 0.03 + 1e-5);
        }
    }
}

#[test]
fn a_body_thinner_than_the_lattice_keeps_one_layer_without_holes() {
    let world = WorldFromCamera::new(Vec3::NEG_Y, 0.0).unwrap();
    for slope in [0.0, 0.5, 2.0] {
        let map = plate(slope);
        let (p, _) = count(&map, 1e-5, 0.008, &world);
        // Every particle but those at the rim has neighbours on both sides in the lattice's own directions: no
        // particle may be further than a cell's diagonal from four others.
        let lonely = p
            .positions
            .iter()
            .filter(|a| {
                let near = |b: &&[f32; 3]| Vec3::from(**a).distance(Vec3::from(**b)) < 0.008 * 1.75;
                p.positions.iter().filter(near).count() < 5
            })
            .count();
        assert!(p.positions.len() > 200, "{}", p.positions.len());
        assert!(lonely * 20 < p.positions.len(), "slope {slope}: {lonely} of {}", p.positions.len());
    }
}

#[test]
fn an_empty_mask_is_named() {
    let world = WorldFromCamera::new(Vec3::NEG_Y, 0.0).unwrap();
    let map = plate(0.0);
    let thick = vec![0.01; map.depth.len()];
    let rgb = vec![[0; 3]; map.depth.len()];
    assert_eq!(MaskBody::new(&map, 4, &thick, &rgb, &world).unwrap_err(), GeometryError::EmptyMask { label: 4 });
    assert!(matches!(
        MaskBody::new(&map, 1, &thick[1..], &rgb, &world).unwrap_err(),
        GeometryError::SizeMismatch { what: "the thickness", .. }
    ));
    // A mask of one pixel at 1 m is 1 mm wide: no lattice point of 100 mm is seen through it.
    let mut dot = map.clone();
    dot.labels.fill(0);
    dot.labels[70 * 240 + 120] = 1;
    let body = MaskBody::new(&dot, 1, &thick, &rgb, &world).unwrap();
    let text = lattice(0.1).fill_mask("dot", &body).unwrap_err().to_string();
    assert!(text.starts_with("object 'dot' got no particles: its smallest extent is 1.00e-2 m"), "{text}");
}

/// A bar two points wide with a strand of single points at its end: the strand goes, the bar stays; a body that is
/// nothing but a strand stays as it is.
#[test]
fn whiskers_are_shaved_off() {
    let site = |x: i32, y: i32, z: i32| ([x, y, z], [0.5; 3]);
    let bar: Vec<Site> = (0..6).flat_map(|x| [site(x, 0, 0), site(x, 1, 0)]).collect();
    let strand: Vec<Site> = (6..12).map(|x| site(x, 0, 0)).collect();
    let kept = shave([bar.clone(), strand.clone()].concat());
    assert_eq!(kept, bar);
    assert_eq!(shave(strand.clone()), strand);
}
