//! Images that follow each other (`animMap`) as one image that a texture's transform steps through.

use super::images::load;
use super::look::{Edit, Picture, Slot};
use crate::files::GameFiles;
use crate::image::Image;
use glam::Vec2;
use shaderscript::{Shader, StageImage};

/// Longest side of an image with all of them.
const LONGEST: u32 = 8192;
/// How far beyond an image's edge coordinates may lie and still count as inside.
const EDGE: f32 = 1.0 / 512.0;

/// Images that follow each other.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Film {
    /// Their names, in order.
    pub images: Vec<String>,
    /// What is changed in each.
    pub edit: Option<Edit>,
    /// Whether they lie one below the other instead of side by side.
    pub down: bool,
    /// Which repetition the surfaces show in that direction.
    repetition: i32,
    /// Images per second, as bits.
    frequency: u32,
}

impl Film {
    /// The film that a slot shows, where its material's surfaces, whose coordinates are in `bounds`, show no more than
    /// one repetition in some direction: there is no other way to keep an image from showing its neighbours.
    pub fn of(slot: &Slot, shader: &Shader, bounds: (Vec2, Vec2)) -> Option<Film> {
        let (name, edit) = match &slot.picture {
            Picture::File(name) => (name, None),
            Picture::Edited(name, edit) => (name, Some(*edit)),
            _ => return None,
        };
        let (frequency, images) = shader.stages.iter().find_map(|stage| match &stage.image {
            StageImage::Animation { frequency, images }
                if images.first() == Some(name) && images.len() > 1 =>
            {
                Some((*frequency, images))
            }
            _ => None,
        })?;
        let (least, most) = bounds;
        let low = (least + Vec2::splat(EDGE)).floor();
        let alone = most.cmple(low + Vec2::splat(1.0 + EDGE));
        let down = !alone.x;
        let usable = slot.tc_mods.is_empty() && frequency > 0.0 && frequency.is_finite();
        (usable && alone.any()).then(|| Film {
            images: images.clone(),
            edit,
            down,
            repetition: if down { low.y } else { low.x } as i32,
            frequency: frequency.to_bits(),
        })
    }

    /// Images per second.
    pub fn frequency(&self) -> f32 {
        f32::from_bits(self.frequency)
    }

    /// Size and offset of the coordinates that show an image, in an image of all that is `side` texels long in their
    /// direction: half a texel is left out at its ends, so that filters do not mix neighbours.
    pub fn transform(&self, number: usize, side: u32) -> (Vec2, Vec2) {
        let count = self.images.len() as f32;
        let part = count.recip();
        let half = 0.5 / side.max(1) as f32;
        let size = part - 2.0 * half;
        let begin = number as f32 * part + half - self.repetition as f32 * size;
        match self.down {
            false => (Vec2::new(size, 1.0), Vec2::new(begin, 0.0)),
            true => (Vec2::new(1.0, size), Vec2::new(0.0, begin)),
        }
    }

    /// All images in one; `None` when one is missing, they are not of one size, or are too large together.
    pub fn image(
        &self,
        files: &dyn GameFiles,
        edit: impl Fn(&Image, Edit) -> Image,
    ) -> Option<Image> {
        let mut frames = Vec::with_capacity(self.images.len());
        for name in &self.images {
            let image = load(files, name)?.0;
            frames.push(match self.edit {
                Some(change) => edit(&image, change),
                None => image,
            });
        }
        let first = frames.first()?;
        let (width, height) = (first.width, first.height);
        let count = u32::try_from(frames.len()).ok()?;
        let alike = frames
            .iter()
            .all(|f| (f.width, f.height) == (width, height));
        let side = if self.down { height } else { width }.checked_mul(count)?;
        if !alike || side > LONGEST || width == 0 {
            return None;
        }
        if self.down {
            let rgba = frames.iter().flat_map(|f| f.rgba.iter().copied());
            return Image::from_rgba(width, side, rgba.collect());
        }
        let row = width as usize * 4;
        let rgba = (0..height as usize).flat_map(|y| {
            let rows = frames
                .iter()
                .filter_map(move |f| f.rgba.get(y * row..(y + 1) * row));
            rows.flatten().copied()
        });
        Image::from_rgba(side, height, rgba.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::MemoryFiles;
    use shaderscript::Stage;

    fn shader() -> Shader {
        let stage = Stage {
            image: StageImage::Animation {
                frequency: 5.0,
                images: vec!["a".into(), "b".into()],
            },
            ..Stage::default()
        };
        Shader {
            stages: vec![stage],
            ..Shader::new("m")
        }
    }

    fn slot(name: &str) -> Slot {
        Slot {
            picture: Picture::File(name.into()),
            clamp: false,
            tc_mods: Vec::new(),
        }
    }

    #[test]
    fn a_film_needs_one_direction_without_repetition() {
        let film = |least, most| Film::of(&slot("a"), &shader(), (Vec2::splat(least), most));
        assert!(!film(0.0, Vec2::ONE).unwrap().down);
        assert!(film(0.0, Vec2::new(4.0, 1.0)).unwrap().down);
        assert_eq!(film(0.0, Vec2::splat(2.0)), None);
        assert_eq!(film(-0.5, Vec2::ONE), None);
        let left = film(-3.0, Vec2::new(-2.0, 1.0)).unwrap();
        let (size, offset) = left.transform(1, 64);
        assert!(((-2.5) * size.x + offset.x - 0.75).abs() < 1e-5);
        assert_eq!(
            Film::of(&slot("b"), &shader(), (Vec2::ZERO, Vec2::ONE)),
            None
        );
    }

    #[test]
    fn each_image_is_shown_alone() {
        let tga = |grey: u8| {
            let header = [0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 2, 0, 24, 0x20];
            [&header[..], &[grey; 12]].concat()
        };
        let mut files = MemoryFiles::new();
        files.insert("a.tga", tga(10)).unwrap();
        files.insert("b.tga", tga(20)).unwrap();
        for most in [Vec2::ONE, Vec2::new(2.0, 1.0)] {
            let film = Film::of(&slot("a"), &shader(), (Vec2::ZERO, most)).unwrap();
            let image = film.image(&files, |i, _| i.clone()).unwrap();
            let side = if film.down { image.height } else { image.width };
            assert_eq!((side, image.rgba.len()), (4, 32));
            for (number, grey) in [(0, 10), (1, 20)] {
                let (size, offset) = film.transform(number, side);
                for st in [Vec2::ZERO, Vec2::splat(0.5), Vec2::splat(0.999)] {
                    let at =
                        (st * size + offset) * Vec2::new(image.width as f32, image.height as f32);
                    let texel = at.y as usize * image.width as usize + at.x as usize;
                    assert_eq!(image.rgba[texel * 4], grey, "{number} {st}");
                }
            }
        }
        files.insert("b.tga", tga(20)[..18].to_vec()).unwrap();
        let film = Film::of(&slot("a"), &shader(), (Vec2::ZERO, Vec2::ONE)).unwrap();
        assert!(film.image(&files, |i, _| i.clone()).is_none());
    }
}
