//! Measures of motion: tips of a held body, their paths in the picture, pieces that came off. Knows no pictures.

use glam::{Vec2, Vec3};
use physvideo_gpu::kernels::Camera;

/// Particles farther from what is held than every other within `around` [m]: the tips of leaves. `held` must hold at
/// least one particle; without any there is no tip.
pub fn tips(positions: &[[f32; 3]], held: &[bool], around: f32) -> Vec<usize> {
    let at: Vec<Vec3> = positions.iter().map(|x| Vec3::from(*x)).collect();
    let root: Vec<Vec3> = at.iter().zip(held).filter(|(_, held)| **held).map(|(x, _)| *x).collect();
    if root.is_empty() {
        return Vec::new();
    }
    let centre = root.iter().sum::<Vec3>() / root.len() as f32;
    let far: Vec<f32> = at.iter().map(|x| x.distance(centre)).collect();
    let higher = |i: usize, j: usize| far[j] > far[i] || (far[j] == far[i] && j < i);
    (0..at.len())
        .filter(|i| !held[*i])
        .filter(|i| !(0..at.len()).any(|j| higher(*i, j) && at[j].distance(at[*i]) < around))
        .collect()
}

/// Where the camera sees a point [px].
pub fn project(camera: &Camera, x: [f32; 3]) -> Vec2 {
    let axis = |row: [f32; 4]| row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + row[3];
    let z = axis(camera.forward).max(camera.near);
    Vec2::new(axis(camera.right), axis(camera.down)) / z * Vec2::from(camera.focal) + Vec2::from(camera.center)
}

/// The path [px] of each of `points` through frames of positions.
pub fn paths(camera: &Camera, frames: &[Vec<[f32; 3]>], points: &[usize]) -> Vec<Vec<Vec2>> {
    points.iter().map(|p| frames.iter().map(|x| project(camera, x[*p])).collect()).collect()
}

/// The greatest distance from its start that a path reaches [px].
pub fn reach(path: &[Vec2]) -> f32 {
    path.iter().map(|p| p.distance(path[0])).fold(0.0, f32::max)
}

/// How often a path turns round along its main direction; swings below `least` [px] are not counted.
pub fn reversals(path: &[Vec2], least: f32) -> usize {
    let far = path.iter().map(|p| *p - path[0]).max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    let direction = far.unwrap_or_default().normalize_or_zero();
    let (mut turns, mut sense, mut extreme) = (0, 0.0f32, 0.0f32);
    for s in path.iter().map(|p| (*p - path[0]).dot(direction)) {
        if sense == 0.0 {
            if (s - extreme).abs() >= least {
                (sense, extreme) = ((s - extreme).signum(), s);
            }
        } else if (s - extreme) * sense >= 0.0 {
            extreme = s;
        } else if (s - extreme).abs() >= least {
            (turns, sense, extreme) = (turns + 1, -sense, s);
        }
    }
    turns
}

/// Pixels of `mask` in pieces that no pixel of `held` is part of; pixels touch at edges and corners.
pub fn islands(width: usize, mask: &[bool], held: &[bool]) -> usize {
    let (w, h) = (width as isize, (mask.len() / width) as isize);
    let mut joined: Vec<bool> = mask.iter().zip(held).map(|(m, held)| *m && *held).collect();
    let mut open: Vec<usize> = (0..mask.len()).filter(|i| joined[*i]).collect();
    while let Some(i) = open.pop() {
        let (x, y) = (i as isize % w, i as isize / w);
        for (u, v) in (-1..=1).flat_map(|v| (-1..=1).map(move |u| (x + u, y + v))) {
            if (0..w).contains(&u) && (0..h).contains(&v) {
                let j = (v * w + u) as usize;
                if mask[j] && !joined[j] {
                    joined[j] = true;
                    open.push(j);
                }
            }
        }
    }
    mask.iter().zip(&joined).filter(|(m, j)| **m && !**j).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_of_a_cross_are_tips() {
        let arm = |d: [f32; 3]| (1..=10).map(move |i| d.map(|c| c * i as f32 * 0.02));
        let mut x = vec![[0.0; 3]];
        x.extend(arm([1.0, 0.0, 0.0]));
        x.extend(arm([0.0, 1.0, 0.5]));
        let held: Vec<bool> = (0..x.len()).map(|i| i == 0).collect();
        assert_eq!(tips(&x, &held, 0.05), [10, 20]);
        assert_eq!(tips(&x, &vec![false; x.len()], 0.05), [0usize; 0]);
    }

    #[test]
    fn a_pinhole_projects() {
        let camera = Camera {
            right: [1.0, 0.0, 0.0, 0.0],
            down: [0.0, 0.0, -1.0, 0.0],
            forward: [0.0, 1.0, 0.0, 2.0],
            focal: [100.0; 2],
            center: [32.0, 24.0],
            near: 1e-3,
            ..Default::default()
        };
        assert_eq!(project(&camera, [0.5, 0.5, 0.25]), Vec2::new(52.0, 14.0));
    }

    #[test]
    fn swings_are_counted_and_trembling_is_not() {
        let path =
            |f: &dyn Fn(f32) -> f32| -> Vec<Vec2> { (0..100).map(|t| Vec2::new(0.6, 0.8) * f(t as f32)).collect() };
        // Half-waves of 20 frames: turns at 10, 30, 50, 70 and 90.
        let swing = path(&|t| 10.0 * (std::f32::consts::PI * t / 20.0).sin());
        assert_eq!((reversals(&swing, 2.0), reach(&swing).round() as i32), (5, 10));
        assert_eq!(reversals(&path(&|t| 0.1 * t + 0.5 * t.sin()), 2.0), 0);
        assert_eq!(reversals(&path(&|_| 0.0), 2.0), 0);
    }

    #[test]
    fn pieces_without_a_held_pixel_are_islands() {
        let picture = "##..#\n.#...\n..#.#\n....#\n";
        let mask: Vec<bool> = picture.chars().filter(|c| *c != '\n').map(|c| c == '#').collect();
        let held: Vec<bool> = (0..mask.len()).map(|i| i == 0).collect();
        assert_eq!(islands(5, &mask, &held), 3);
        assert_eq!(islands(5, &mask, &vec![false; mask.len()]), 7);
    }
}
