//! Which worlds qualify, and what is said of those that do not.

use physvideo::elastic::{choose, undamped};
use physvideo::scene::Elastic;
use physvideo::stages::lagrangian::{Unfit, fit};
use physvideo::world::World;
use physvideo_gpu::kernels::Collider;
use physvideo_gpu::kernels::family::shape::BALL;

use super::setup::{body, fill, world};

const DX: f64 = 1.0 / 16.0;

#[test]
fn bodies_on_a_lattice_qualify() {
    let cube = || body((1e5, 0.3), 1000.0, DX, fill(DX, [0.1; 3], [0.6; 3], |_| true), |_| [0.0; 3]);
    let mut good = world(vec![cube()], DX);
    assert!(choose(Elastic::Auto, &good).unwrap().total_lagrangian, "what falls has one too");
    good.bodies[0].pinned = good.bodies[0].positions.iter().map(|x| x[2] < 0.2).collect();
    assert_eq!(fit(&good), Ok(()));
    assert!(choose(Elastic::Auto, &good).unwrap().total_lagrangian);
    assert!(!choose(Elastic::UpdatedLagrangian, &good).unwrap().total_lagrangian);

    // One particle off its place; two at one place; other spacings; none; two bodies.
    let mut off = world(vec![cube()], DX);
    off.bodies[0].positions[7][1] += 0.1 * DX as f32;
    assert_eq!(fit(&off), Err((0, Unfit::Irregular)));
    let mut twice = world(vec![cube()], DX);
    twice.bodies[0].positions[7] = twice.bodies[0].positions[8];
    assert_eq!(fit(&twice), Err((0, Unfit::Irregular)));
    assert_eq!(fit(&world(vec![cube()], 0.8 * DX)), Err((0, Unfit::Spacing)));
    let mut none = world(vec![cube()], DX);
    none.bodies[0].positions.clear();
    assert_eq!(fit(&none), Err((0, Unfit::Empty)));
    let moved = |by: f32| {
        let mut other = cube();
        other.positions.iter_mut().for_each(|x| x[1] += by);
        other
    };
    // Side by side they are a spacing apart; one that is half a cell inside the other is not told by contact.
    let mut two = world(vec![cube(), moved(0.5)], DX);
    let inside = world(vec![cube(), moved(0.5 - DX as f32)], DX);
    let refused = choose(Elastic::TotalLagrangian, &inside).unwrap_err();
    assert!(format!("{refused:?}").contains("overlap"), "{refused:?}");
    let choice = choose(Elastic::Auto, &off).unwrap();
    assert!(!choice.total_lagrangian && choice.why.contains("no regular lattice"), "{choice:?}");
    // A held sheet one particle thick is as good as any; what cannot be done is refused with the place of the key.
    let mut sheet = body((1e5, 0.3), 1000.0, DX, fill(DX, [0.0; 3], [0.5, 0.5, DX / 2.0], |_| true), |_| [0.0; 3]);
    sheet.pinned = sheet.positions.iter().map(|x| x[0] < 0.1).collect();
    assert!(choose(Elastic::Auto, &world(vec![sheet], DX)).unwrap().total_lagrangian);
    assert!(choose(Elastic::TotalLagrangian, &two).unwrap().total_lagrangian);
    two.bodies.iter_mut().for_each(|b| b.pinned = good.bodies[0].pinned.clone());
    let both = choose(Elastic::Auto, &two).unwrap();
    assert!(both.total_lagrangian && both.why.starts_with("2 elastic bodies"), "{both:?}");
    let refused = choose(Elastic::TotalLagrangian, &off).unwrap_err();
    assert!(format!("{refused:?}").contains("simulation.elastic"), "{refused:?}");
}

/// An obstacle narrower than a body is long could pass into its surface, and one that a body begins in is not met from outside.
#[test]
fn obstacles_decide_too() {
    let cube = || body((1e5, 0.3), 1000.0, DX, fill(DX, [0.1; 3], [0.6; 3], |_| true), |_| [0.0; 3]);
    let ball = |radius: f32, z: f32| Collider {
        shape: BALL,
        end: 1e9,
        center: [0.35, 0.35, z, 0.0],
        size: [radius, 0.0, 0.0, 0.0],
        ..Default::default()
    };
    let beside = |c: Collider| World { colliders: vec![c], ..world(vec![cube()], DX) };
    let chosen = |w: &World| choose(Elastic::Auto, w).unwrap();
    assert!(chosen(&beside(ball(0.3, -0.3))).total_lagrangian, "it is wider than the cube");
    let small = beside(ball(0.1, -0.1));
    assert!(chosen(&small).total_lagrangian, "what is inside is met as well");
    // A soft one would let a ball of three cells come through: 1000 kg/m³ · (g · 0.47 m) is 0.4 of its μ of 11.5 kPa.
    let soft = |young: f64, g: f32| {
        let mut w = small.clone();
        w.gravity = [0.0, 0.0, -g];
        w.bodies[0].material = physvideo::scene::Material::Elastic { young: young as f32, poisson: 0.3 };
        w.domain.0[2] = 0.1;
        w
    };
    let pierced = chosen(&soft(3e4, 9.81));
    assert!(
        !pierced.total_lagrangian && pierced.why.contains("is soft") && pierced.why.contains("0.20 m, 3.2"),
        "{pierced:?}"
    );
    assert!(chosen(&soft(1e5, 9.81)).total_lagrangian && chosen(&soft(3e4, 1.0)).total_lagrangian);
    assert!(choose(Elastic::TotalLagrangian, &soft(3e4, 9.81)).unwrap().total_lagrangian);
    // What is thin has no inside.
    let mut sheet = small.clone();
    sheet.bodies[0].positions.retain(|x| x[2] < 0.1 + DX as f32);
    let left = sheet.bodies[0].positions.len();
    sheet.bodies[0].velocities.truncate(left);
    let pierced = chosen(&sheet);
    assert!(!pierced.total_lagrangian && pierced.why.contains("is thin"), "{pierced:?}");
    let inside = beside(ball(0.3, 0.0));
    assert!(chosen(&inside).why.contains("starts inside an obstacle"), "{:?}", chosen(&inside));
    let refused = choose(Elastic::TotalLagrangian, &inside).unwrap_err();
    assert!(format!("{refused:?}").contains("starts inside an obstacle"), "{refused:?}");
}

/// One that nothing holds is on a grid of its own if it meets nothing at more than twice its waves' speed.
#[test]
fn a_free_body_qualifies_if_slow() {
    let ball = |damping: f32, speed: f32| {
        let mut ball = body((1e5, 0.3), 1000.0, DX, fill(DX, [0.1; 3], [0.6; 3], |_| true), |_| [speed, 0.0, 0.0]);
        ball.damping = damping;
        world(vec![ball], DX)
    };
    // Waves of 11.6 m/s, and nothing to fall by.
    for damping in [0.0, 1e-3] {
        assert!(choose(Elastic::Auto, &ball(damping, 23.0)).unwrap().total_lagrangian);
        let choice = choose(Elastic::Auto, &ball(damping, 24.0)).unwrap();
        let why = "2 times the speed of its waves, 11.6 m/s";
        assert!(!choice.total_lagrangian && choice.why.contains(why), "{choice:?}");
    }
    // What the shared grid moves loses its damping, and is told so.
    let mut fast = ball(1e-3, 24.0);
    let choice = choose(Elastic::Auto, &fast).unwrap();
    let notes = undamped(&choice, &mut fast);
    assert!(notes.len() == 1 && notes[0].contains("`damping` of 'body' is left out"), "{notes:?}");
    assert!(fast.bodies[0].damping == 0.0 && undamped(&choice, &mut ball(0.0, 6.0)).is_empty());
}

/// Beside what is not elastic each body is decided on by itself; what all bodies are decided on alike stays so.
#[test]
fn beside_sand_a_held_body_has_a_grid_of_its_own() {
    let cube = |x: f64, held: bool| {
        let mut cube =
            body((1e5, 0.3), 1000.0, DX, fill(DX, [x, 0.0, 0.0], [x + 0.5, 0.5, 0.5], |_| true), |_| [0.0; 3]);
        cube.pinned = cube.positions.iter().map(|p| held && p[2] < 0.1).collect();
        cube
    };
    let named = |mut b: physvideo::world::Body, name: &str| {
        b.name = name.into();
        b
    };
    let mut sand = named(cube(2.0, false), "sand");
    sand.material = physvideo::scene::Material::Sand { young: 1e6, poisson: 0.3, friction: 0.7 };
    let mut w = world(vec![sand, named(cube(0.0, true), "leaf"), named(cube(1.0, false), "ball")], DX);
    let auto = choose(Elastic::Auto, &w).unwrap();
    assert!(!auto.total_lagrangian && auto.beside == [false, true, true], "{auto:?}");
    assert_eq!(
        auto.why,
        "'sand' by MPM (has a material that is not elastic), 'leaf' on a grid of its own (elastic and held), 'ball' on a \
         grid of its own (elastic)"
    );
    // Beside matter of the grid one that is fast for its waves is left to it.
    let mut fast = w.clone();
    let speed = 0.6 * fast.bodies[2].wave_speed();
    fast.bodies[2].velocities.fill([speed, 0.0, 0.0]);
    let auto = choose(Elastic::Auto, &fast).unwrap();
    assert!(auto.beside == [false, true, false] && auto.why.contains("more than 0.5 times the speed"), "{auto:?}");
    assert_eq!(choose(Elastic::TotalLagrangian, &w).unwrap().beside, [false, true, true]);
    assert!(choose(Elastic::UpdatedLagrangian, &w).unwrap().beside.is_empty());
    // What is only a cell thick is left to the shared grid, through which nothing passes, unless it is asked for.
    let mut thin = w.clone();
    let leaf = &mut thin.bodies[1];
    let kept: Vec<usize> = (0..leaf.positions.len()).filter(|i| leaf.positions[*i][1] < DX as f32).collect();
    leaf.positions = kept.iter().map(|i| leaf.positions[*i]).collect();
    leaf.velocities = kept.iter().map(|i| leaf.velocities[*i]).collect();
    leaf.pinned = kept.iter().map(|i| leaf.pinned[*i]).collect();
    assert_eq!(choose(Elastic::Auto, &thin).unwrap().beside, [false, false, true]);
    assert_eq!(choose(Elastic::TotalLagrangian, &thin).unwrap().beside, [false, true, true]);
    // One inside the sand stays with it, or is refused where that is not wanted.
    let shift = |b: &mut physvideo::world::Body, by: f32| b.positions.iter_mut().for_each(|x| x[0] += by);
    shift(&mut w.bodies[1], 1.75);
    assert_eq!(choose(Elastic::Auto, &w).unwrap().beside, [false, false, true]);
    let refused = format!("{:?}", choose(Elastic::TotalLagrangian, &w).unwrap_err());
    assert!(refused.contains("'sand' and 'leaf' overlap"), "{refused}");
    // Without sand all are decided on alike, as ever.
    w.bodies.remove(0);
    assert!(choose(Elastic::Auto, &w).unwrap().beside.is_empty());
}
