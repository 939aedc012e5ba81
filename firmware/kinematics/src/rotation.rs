//! Orientation of the platform as a matrix.

use eel_units::{Angle, angle_over_sine, round_shift, saturate};

use crate::pose::Pose;
use crate::vector::{Vector, add_cross, dot, over_root_two, times, times_minus, times_plus};

/// The platform's orientation: the columns of R in Q30, each a unit vector to 3 parts in 10⁹.
///
/// Made from a pose or by the direct kinematics only, so that it always is a rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rotation {
    columns: [Vector; 3],
}

impl Rotation {
    pub(crate) const fn from_columns(columns: [Vector; 3]) -> Self {
        Self { columns }
    }

    /// Returns the columns of R in Q30: the platform's points C1 and C2, and its z axis.
    #[inline]
    pub const fn columns(&self) -> &[[i32; 3]; 3] {
        &self.columns
    }

    /// Makes the orientation of a pose, any pose; each number wrong by at most 8 parts in 10⁹.
    pub fn from_pose(pose: &Pose) -> Self {
        let (sy, cy) = pose.yaw.sin_cos();
        let (sp, cp) = pose.pitch.sin_cos();
        let (sr, cr) = pose.roll.sin_cos();
        // Sine and cosine of roll + π/4.
        let cq = over_root_two(cr - sr);
        let sq = over_root_two(cr + sr);
        // Ry Rz, the rows that Rx will turn, and Rx.
        let spcq = times(sp, cq);
        let spsq = times(sp, sq);
        Self {
            columns: [
                [
                    times(cp, cq),
                    times_plus(cy, sq, sy, spcq),
                    times_minus(sy, sq, cy, spcq),
                ],
                [
                    times(cp, sq).wrapping_neg(),
                    times_minus(cy, cq, sy, spsq),
                    times_plus(sy, cq, cy, spsq),
                ],
                [sp, times(sy, cp).wrapping_neg(), times(cy, cp)],
            ],
        }
    }

    /// Returns the pose of this orientation, pitch within ±π/2; wrong by at most 8 nrad while
    /// |pitch| ≤ 1 rad.
    pub fn to_pose(&self) -> Pose {
        let [[xx, ..], [yx, ..], [zx, zy, zz]] = self.columns;
        // cos pitch turned by (cos, sin) of roll + π/4; by roll alone after a turn back by π/4.
        let across = saturate(-i64::from(yx) - i64::from(xx));
        let along = saturate(-i64::from(yx) + i64::from(xx));
        let roll = Angle::from_sides(across >> 1, along >> 1);
        let yaw = Angle::from_sides(zy.wrapping_neg(), zz);
        // The cosine of pitch from the better of its two forms would need a root; turning the z
        // axis back by yaw gives it without one.
        let (sy, cy) = yaw.sin_cos();
        let pitch = Angle::from_sides(zx, times_minus(zz, cy, zy, sy));
        Pose { yaw, pitch, roll }
    }

    /// Returns the rotation vector, in the base frame, that leads from this orientation to `target`.
    ///
    /// Exact to 4 parts in 10⁶ and 6 nrad while the angle between them is at most π/2; beyond it
    /// the direction stays right, and the length falls from π/2 to zero at half a turn.
    pub fn error_to(&self, target: &Self) -> [Angle; 3] {
        let mut sine = [0i64; 3];
        let mut trace = 0i64;
        for (from, to) in self.columns.iter().zip(&target.columns) {
            // ½ Σ rᵢ × rᵢ' is the axis times the sine; Σ rᵢ · rᵢ' is 1 + twice the cosine.
            add_cross(&mut sine, from, to);
            trace += dot(from, to);
        }
        let cosine = round_shift::<31>(trace - (1 << 60));
        let factor = angle_over_sine(cosine);
        sine.map(|twice| {
            let component = round_shift::<31>(twice);
            Angle::from_q29(round_shift::<30>(i64::from(component) * i64::from(factor)))
        })
    }
}

impl Default for Rotation {
    fn default() -> Self {
        Self::from_pose(&Pose::HOME)
    }
}
