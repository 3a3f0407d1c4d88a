//! What is above a room: beams and barrel vaults.

use glam::{DVec2, DVec3, dvec2, dvec3};
use std::f64::consts::PI;

use super::Room;
use crate::common::mesh::{Finish, Model};
use crate::common::parts::{Line, Side, cuboid};

impl<'a> Room<'a> {
    pub(super) fn beams(&self, m: &mut Model<'a>, apart: f64) {
        let size = self.size();
        let across_z = size.x >= size.y;
        let long = if across_z { size.x } else { size.y };
        let n = (long / apart).round().max(1.0) as usize;
        for k in 0..n {
            let at = (k as f64 + 0.5) * long / n as f64;
            let y = [self.high.y - 0.22, self.high.y];
            let (low, high) = if across_z {
                let x = self.low.x + at;
                (dvec3(x - 0.09, y[0], self.low.z), dvec3(x + 0.09, y[1], self.high.z))
            } else {
                let z = self.low.z + at;
                (dvec3(self.low.x, y[0], z - 0.09), dvec3(self.high.x, y[1], z + 0.09))
            };
            let ends = if across_z { [Side::North, Side::South] } else { [Side::West, Side::East] };
            cuboid(m, self.finishes.wood, low, high, &[Side::Top, ends[0], ends[1]]);
        }
    }

    pub(super) fn barrel(&self, m: &mut Model<'a>, along_x: bool, rise: f64, ribs: bool) {
        let (run, across) = if along_x {
            ([self.low.x, self.high.x], [self.low.z, self.high.z])
        } else {
            ([self.low.z, self.high.z], [self.low.x, self.high.x])
        };
        let shell = half_ellipse(across, self.high.y, rise);
        self.arch(m, self.finishes.ceiling, &shell, run, along_x);
        if ribs {
            let inner = half_ellipse([across[0] + 0.12, across[1] - 0.12], self.high.y, rise - 0.12);
            let n = ((run[1] - run[0]) / 2.6).round().max(1.0) as usize;
            for k in 0..=n {
                let middle = run[0] + (run[1] - run[0]) * k as f64 / n as f64;
                let side = [(middle - 0.15).max(run[0]), (middle + 0.15).min(run[1])];
                self.arch(m, self.finishes.stone, &inner, side, along_x);
                for (at, sign) in [(side[0], -1.0), (side[1], 1.0)] {
                    let towards = if along_x { DVec3::X } else { DVec3::Z } * sign;
                    for (a, b) in inner.windows(2).zip(shell.windows(2)) {
                        let corners = [a[0], a[1], b[1], b[0]];
                        let points = corners.map(|c| self.in_barrel(at, c, along_x));
                        m.face_towards(self.finishes.stone, towards, &points, &corners);
                    }
                }
            }
        }
    }

    fn in_barrel(&self, run: f64, p: DVec2, along_x: bool) -> DVec3 {
        if along_x { dvec3(run, p.y, p.x) } else { dvec3(p.x, p.y, run) }
    }

    fn arch(&self, m: &mut Model<'a>, finish: &'a Finish, line: &Line, run: [f64; 2], along_x: bool) {
        let middle = 0.5 * (line[0] + line[line.len() - 1]) - DVec2::Y;
        let mut length = 0.0;
        for pair in line.windows(2) {
            let next = length + pair[0].distance(pair[1]);
            let corners = [(run[0], pair[0]), (run[1], pair[0]), (run[1], pair[1]), (run[0], pair[1])];
            let points = corners.map(|(r, p)| self.in_barrel(r, p, along_x));
            let inward = self.in_barrel(0.5 * (run[0] + run[1]), middle, along_x) - points[0];
            let metres = [dvec2(run[0], length), dvec2(run[1], length), dvec2(run[1], next), dvec2(run[0], next)];
            m.face_towards(finish, inward, &points, &metres);
            length = next;
        }
    }
}

/// The upper half of an ellipse over a range of u, 24 pieces.
pub(super) fn half_ellipse(span: [f64; 2], spring: f64, rise: f64) -> Line {
    let (centre, half) = (0.5 * (span[0] + span[1]), 0.5 * (span[1] - span[0]));
    (0..=24)
        .map(|i| {
            let a = PI * f64::from(i) / 24.0;
            dvec2(centre - half * a.cos(), spring + rise * a.sin())
        })
        .collect()
}
