//! How far a configuration is from each singularity.

use libm::{atan2, floor, sqrt};
use nalgebra::Matrix3;

use super::{Geometry, Range, rotation, singular_values};

/// Points on each edge of a face of a box that is searched for singularities.
const POINTS: u32 = 25;
/// Steps of the search along each ray, for each multiple of the box.
const STEPS: f64 = 32.0;
/// Halvings that place a singularity on a ray.
const HALVINGS: u32 = 40;
/// The largest multiple of a box that is searched.
const MOST: f64 = 6.0;

/// The margins of a configuration: 1 at home, 0 at the singularity, negative beyond it.
///
/// All are continuous in the configuration (orientation and motors' angles). As a function of the
/// orientation alone a leg's serial margin falls to zero like the root of the distance. Home is the
/// geometry's own, at yaw = pitch = roll = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Serial, where a motor moves nothing: legs 1 and 2 by (l×r)·i over home's, leg 3 by cos φ over
    /// home's.
    pub serial: [f64; 3],
    /// Parallel, where the platform moves with the motors held: det A over home's.
    pub parallel: f64,
    /// The factors of det A over home's: leg 1 by −B1·z'', leg 2 by −B2·z_m.
    ///
    /// Both are positive in home's assembly mode only, det A in one other mode too.
    pub depths: [f64; 2],
    /// The least singular value of A in arms: what det A is to a volume this is to the weakest
    /// direction; never negative.
    pub least_singular: f64,
}

impl Margins {
    /// Returns the lesser serial margin of legs 1 and 2, which the firmware's kernel watches.
    pub fn legs(&self) -> f64 {
        self.serial[0].min(self.serial[1])
    }

    /// Returns the least margin: of serial and parallel, and outside home's assembly mode of what
    /// is negative there.
    pub fn least(&self) -> f64 {
        let serial = self.legs().min(self.serial[2]);
        let [first, second] = self.depths;
        if first > 0.0 && second > 0.0 {
            serial.min(self.parallel)
        } else {
            serial.min(first).min(second)
        }
    }
}

impl Geometry {
    /// Returns the margins of a configuration; nothing where the geometry does not reach its home.
    pub fn margins(&self, rotation: &Matrix3<f64>, theta: &[f64; 3]) -> Option<Margins> {
        let at_home = super::rotation(0.0, 0.0, 0.0);
        let home = self.inverse(&at_home)?;
        let (wanted, deep) = (
            self.jacobians(&at_home, &home),
            self.depths(&at_home, &home),
        );
        let jacobians = self.jacobians(rotation, theta);
        let depths = self.depths(rotation, theta);
        let [.., least_singular] = singular_values(&jacobians.a);
        Some(Margins {
            serial: [0, 1, 2].map(|leg| jacobians.b[leg] / wanted.b[leg]),
            parallel: jacobians.det_a() / wanted.det_a(),
            depths: [depths[0] / deep[0], depths[1] / deep[1]],
            least_singular,
        })
    }

    /// Returns how well legs 1 and 2 reach an orientation: ((l×r)·i)² in arms, which the orientation
    /// alone gives; zero at a serial singularity, negative out of reach.
    pub fn reach(&self, rotation: &Matrix3<f64>) -> [f64; 2] {
        let scale = self.arm * self.arm * self.arm * self.arm;
        [0, 1].map(|leg| self.legs[leg].discriminant(&self.point(rotation, leg)) / scale)
    }

    /// Returns the least margin at an orientation in home's working mode, continuous also where a leg
    /// does not reach; nothing where the geometry does not reach its home.
    ///
    /// Out of reach it is that of [`Geometry::nearest`], or minus the root of what the leg lacks if
    /// that is less: ((l×r)·i)² over home's is negative there.
    pub fn least_margin(&self, orientation: &Matrix3<f64>) -> Option<f64> {
        let found = self.margins(orientation, &self.nearest(orientation))?;
        if self.inverse(orientation).is_some() {
            return Some(found.least());
        }
        let home = self.reach(&rotation(0.0, 0.0, 0.0));
        let here = self.reach(orientation);
        let lack = (-here[0] / home[0]).max(-here[1] / home[1]);
        Some(found.least().min(-sqrt(lack.max(0.0))))
    }

    /// Returns the motors' angles for an orientation in home's working mode; where a leg does not
    /// reach, the crank points to where its rod comes nearest to the platform.
    pub fn nearest(&self, orientation: &Matrix3<f64>) -> [f64; 3] {
        let [first, second] = [0, 1].map(|leg| {
            let point = self.point(orientation, leg);
            let nearest = self.legs[leg].nearest(&point);
            self.legs[leg]
                .inverse(&point)
                .map_or(nearest, |both| both[0])
        });
        let third = atan2(orientation[(1, 0)], orientation[(0, 0)]);
        [first, second, third]
    }

    /// Returns how far a box of yaw, pitch and roll may grow about home before it meets a
    /// singularity or the end of reach: the factor, at most 6; zero where home is not clear.
    ///
    /// Rays from home to a grid on the box's faces, 25 points an edge, are searched in steps of 1/32.
    pub fn largest_box(&self, within: &[Range; 3]) -> f64 {
        let mut best = MOST;
        let share = |k: u32| f64::from(k) / f64::from(POINTS - 1);
        for face in 0..6 {
            for (i, j) in (0..POINTS).flat_map(|i| (0..POINTS).map(move |j| (i, j))) {
                let end = f64::from(face % 2);
                let shares = match face / 2 {
                    0 => [end, share(i), share(j)],
                    1 => [share(i), end, share(j)],
                    _ => [share(i), share(j), end],
                };
                let ray = [0, 1, 2].map(|k| within[k].at(shares[k]));
                best = self.first_stop(ray, best);
            }
        }
        best
    }

    /// Returns the least multiple of a pose, up to `most`, at which no margin is left.
    fn first_stop(&self, ray: [f64; 3], most: f64) -> f64 {
        let is_clear = |factor: f64| {
            let [yaw, pitch, roll] = ray.map(|angle| angle * factor);
            let least = self.least_margin(&rotation(yaw, pitch, roll));
            least.is_some_and(|margin| margin > 0.0)
        };
        let last = floor(most * STEPS) as u32;
        let stop = (0..=last)
            .map(|step| f64::from(step) / STEPS)
            .chain([most])
            .find(|factor| !is_clear(*factor));
        let Some(mut high) = stop else {
            return most;
        };
        let mut low = (high - 1.0 / STEPS).max(0.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if is_clear(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }
}
