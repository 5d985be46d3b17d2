//! Affine transforms of bones and joints.

use glam::{Vec3, Vec4};

/// A transform as three rows of four: what a position's x, y and z are made of.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BoneMatrix {
    /// Rows; the fourth column is the translation.
    pub rows: [Vec4; 3],
}

impl BoneMatrix {
    /// Leaves everything where it is.
    pub const IDENTITY: BoneMatrix = BoneMatrix {
        rows: [Vec4::X, Vec4::Y, Vec4::Z],
    };
    /// Adds nothing to a sum of matrices.
    pub const ZERO: BoneMatrix = BoneMatrix {
        rows: [Vec4::ZERO; 3],
    };

    /// Where a point goes.
    pub fn point(&self, p: Vec3) -> Vec3 {
        let p = p.extend(1.0);
        Vec3::from_array(self.rows.map(|row| row.dot(p)))
    }

    /// Where a direction goes; the translation does not count.
    pub fn direction(&self, v: Vec3) -> Vec3 {
        Vec3::from_array(self.rows.map(|row| row.truncate().dot(v)))
    }

    /// The images of the three axes.
    pub fn axes(&self) -> [Vec3; 3] {
        let [x, y, z] = self.rows;
        [
            Vec3::new(x.x, y.x, z.x),
            Vec3::new(x.y, y.y, z.y),
            Vec3::new(x.z, y.z, z.z),
        ]
    }

    /// The image of the origin.
    pub fn translation(&self) -> Vec3 {
        Vec3::from_array(self.rows.map(|row| row.w))
    }

    /// First `inner`, then this.
    pub fn after(&self, inner: &BoneMatrix) -> BoneMatrix {
        let [x, y, z] = inner.rows;
        BoneMatrix {
            rows: self
                .rows
                .map(|row| x * row.x + y * row.y + z * row.z + Vec4::W * row.w),
        }
    }

    /// `self · a + other · b`, element by element.
    pub fn mix(&self, a: f32, other: &BoneMatrix, b: f32) -> BoneMatrix {
        let mut rows = self.rows;
        for (row, other) in rows.iter_mut().zip(other.rows) {
            *row = *row * a + other * b;
        }
        BoneMatrix { rows }
    }

    /// What undoes this, provided that it turns, moves and scales evenly; of other transforms what the engine takes
    /// for it: each axis by itself is divided by the square of its length. An axis of no length stays so.
    pub fn inverse_of_even(&self) -> BoneMatrix {
        let translation = self.translation();
        let rows = self.axes().map(|axis| {
            let square = axis.length_squared();
            let axis = if square > 0.0 { axis / square } else { axis };
            axis.extend(-axis.dot(translation))
        });
        BoneMatrix { rows }
    }

    /// The transform of normals: the cofactors, which is what keeps a normal across its surface. It lengthens them.
    pub fn of_normals(&self) -> BoneMatrix {
        let [x, y, z] = self.rows.map(Vec4::truncate);
        BoneMatrix {
            rows: [y.cross(z), z.cross(x), x.cross(y)].map(|row| row.extend(0.0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned() -> BoneMatrix {
        // a quarter turn about z, twice the size, moved
        BoneMatrix {
            rows: [
                Vec4::new(0.0, -2.0, 0.0, 5.0),
                Vec4::new(2.0, 0.0, 0.0, 6.0),
                Vec4::new(0.0, 0.0, 2.0, 7.0),
            ],
        }
    }

    #[test]
    fn points_move_directions_turn() {
        let bone = turned();
        assert_eq!(bone.point(Vec3::X), Vec3::new(5.0, 8.0, 7.0));
        assert_eq!(bone.direction(Vec3::X), Vec3::Y * 2.0);
        assert_eq!(bone.axes(), [Vec3::Y * 2.0, -Vec3::X * 2.0, Vec3::Z * 2.0]);
        assert_eq!(bone.translation(), Vec3::new(5.0, 6.0, 7.0));
    }

    #[test]
    fn the_inverse_undoes() {
        let bone = turned();
        assert_eq!(bone.after(&bone.inverse_of_even()), BoneMatrix::IDENTITY);
        assert_eq!(bone.inverse_of_even().after(&bone), BoneMatrix::IDENTITY);
        assert_eq!(bone.after(&BoneMatrix::IDENTITY), bone);
        let p = Vec3::new(1.0, 2.0, 3.0);
        assert_eq!(bone.after(&bone).point(p), bone.point(bone.point(p)));
        assert!(
            BoneMatrix::ZERO
                .inverse_of_even()
                .rows
                .iter()
                .all(|r| r.is_finite())
        );
    }

    #[test]
    fn normals_stay_across() {
        let squeezed = BoneMatrix {
            rows: [Vec4::X * 4.0, Vec4::Y, Vec4::Z],
        };
        let (along, normal) = (Vec3::new(1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0));
        let normal = squeezed.of_normals().direction(normal);
        assert_eq!(squeezed.direction(along).dot(normal), 0.0);
        assert_eq!(
            turned().of_normals().direction(Vec3::X),
            Vec3::Y * 4.0,
            "the engine leaves the length"
        );
    }

    #[test]
    fn mixing_is_linear() {
        let half = turned().mix(0.5, &BoneMatrix::IDENTITY, 0.5);
        assert_eq!(half.point(Vec3::ZERO), Vec3::new(2.5, 3.0, 3.5));
        assert_eq!(turned().mix(1.0, &BoneMatrix::ZERO, 3.0), turned());
    }
}
