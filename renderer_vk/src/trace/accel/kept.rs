//! Records of a top level's instances that stay on the GPU: the CPU writes those that have changed, and a pass lists
//! those of a frame (`shaders/trace/instance_list.comp`).

use bytemuck::Pod;
use shaders::trace_types::ListStep;
use shaders::trace_types::constants::LIST_ROW;

use crate::gpu::{
    Access, Buffer, BufferDesc, BufferUsage, ComputePipeline, Device, Error, Memory, Pass, Recorder,
};

/// Least number of records of a buffer.
const LEAST: usize = 64;

/// Records with a place each, and the list of those that a frame uses.
pub struct Kept<T> {
    pipeline: ComputePipeline,
    /// The record at each place on the GPU; `None`: none was written.
    known: Vec<Option<T>>,
    /// Place of each entry of the list.
    listed: Vec<u32>,
    /// Places of the records that are to be written, and the records.
    changed: Vec<u32>,
    changes: Vec<T>,
    /// The list differs from the last one that was recorded.
    reordered: bool,
    records: Option<Buffer>,
    places: Option<Buffer>,
    list: Option<Buffer>,
    /// Records that the CPU has written, over all frames.
    pub written: u64,
}

impl<T: Pod + PartialEq> Kept<T> {
    /// Without records.
    ///
    /// # Errors
    /// The driver refuses the pipeline.
    pub fn new(device: &Device) -> Result<Self, Error> {
        let shader = &shaders::TRACE_INSTANCE_LIST_COMP;
        Ok(Self {
            pipeline: ComputePipeline::new(device, "trace_instances", shader, &[])?,
            known: Vec::new(),
            listed: Vec::new(),
            changed: Vec::new(),
            changes: Vec::new(),
            reordered: false,
            records: None,
            places: None,
            list: None,
            written: 0,
        })
    }

    /// Takes the list of a frame, each record with its place, which no other has. Whether it differs from the last.
    pub fn take(&mut self, list: impl Iterator<Item = (u32, T)>) -> bool {
        let mut length = 0;
        for (place, record) in list {
            match self.listed.get_mut(length) {
                Some(old) if *old == place => {}
                Some(old) => (*old, self.reordered) = (place, true),
                None => {
                    self.listed.push(place);
                    self.reordered = true;
                }
            }
            length += 1;
            let index = place as usize;
            if self.known.len() <= index {
                self.known.resize(index + 1, None);
            }
            if let Some(known) = self.known.get_mut(index)
                && *known != Some(record)
            {
                *known = Some(record);
                self.changed.push(place);
                self.changes.push(record);
            }
        }
        self.reordered |= length < self.listed.len();
        self.listed.truncate(length);
        self.reordered || !self.changed.is_empty()
    }

    /// Length of the list.
    pub fn len(&self) -> usize {
        self.listed.len()
    }

    /// Address of the list of the last [`take`](Self::take), on the GPU.
    ///
    /// # Errors
    /// Out of memory.
    pub fn record(&mut self, rec: &mut Recorder) -> Result<u64, Error> {
        let size = size_of::<T>();
        let grown = fit(&mut self.records, rec, self.known.len() * size)?;
        let records = grown.address;
        if grown.is_new {
            // its content is lost: all are written anew
            let known = self.known.iter().enumerate();
            let known = known.filter_map(|(place, r)| Some((u32::try_from(place).ok()?, (*r)?)));
            (self.changed, self.changes) = known.unzip();
        }
        let places = fit(&mut self.places, rec, self.listed.len() * size_of::<u32>())?;
        let list = fit(&mut self.list, rec, self.listed.len() * size)?;
        self.reordered |= places.is_new;
        if !self.reordered && self.changed.is_empty() && !list.is_new {
            return Ok(list.address);
        }
        let source = rec.arena().push(&self.changes)?;
        let changed = rec.arena().push(&self.changed)?;
        let used = Access::COMPUTE | Access::TRANSFER;
        let mut pass = rec.pass("trace_instances", used, used)?;
        if self.reordered
            && !self.listed.is_empty()
            && let Some(target) = &self.places
        {
            let bytes: &[u8] = bytemuck::cast_slice(&self.listed);
            let mut new = pass
                .arena()
                .alloc(bytes.len() as u64, size_of::<u32>() as u64)?;
            new.bytes().copy_from_slice(bytes);
            let (buffer, offset) = (new.buffer().clone(), new.offset);
            pass.copy_buffer(&buffer, offset, target, 0, bytes.len() as u64);
        }
        pass.bind_compute(&self.pipeline);
        let step = |source, places, target, to_places| ListStep {
            source,
            places,
            target,
            words: u32::try_from(size / size_of::<u32>()).unwrap_or(1),
            to_places,
            ..ListStep::default()
        };
        let to_places = step(source, changed, records, 1);
        run(&mut pass, to_places, self.changed.len());
        pass.barrier();
        let to_list = step(records, places.address, list.address, 0);
        run(&mut pass, to_list, self.listed.len());
        self.written += self.changed.len() as u64;
        self.changed.clear();
        self.changes.clear();
        self.reordered = false;
        Ok(list.address)
    }
}

/// Moves `entries` records.
fn run(pass: &mut Pass<'_>, step: ListStep, entries: usize) {
    let count = u32::try_from(entries).unwrap_or(u32::MAX);
    pass.push(&ListStep { count, ..step });
    let words = u64::from(count) * u64::from(step.words);
    let rows = words.div_ceil(u64::from(LIST_ROW));
    let row = words.min(u64::from(LIST_ROW));
    let side = |length: u64| u32::try_from(length).unwrap_or(u32::MAX);
    pass.dispatch_invocations(side(row), side(rows));
}

/// A buffer that is large enough.
struct Fitted {
    address: u64,
    /// Its content is undefined.
    is_new: bool,
}

/// Makes a larger buffer if one has less than so many bytes.
fn fit(buffer: &mut Option<Buffer>, rec: &Recorder, bytes: usize) -> Result<Fitted, Error> {
    if let Some(old) = buffer.as_ref().filter(|old| old.size() >= bytes as u64) {
        return Ok(Fitted {
            address: old.address(),
            is_new: false,
        });
    }
    let size = bytes.max(LEAST * size_of::<u64>()).next_power_of_two() as u64;
    let desc = BufferDesc {
        name: "trace instances",
        size,
        usage: BufferUsage::ACCEL_INPUT,
        memory: Memory::Device,
    };
    *buffer = None;
    let made = Buffer::new(rec.device(), &desc)?;
    let address = made.address();
    *buffer = Some(made);
    Ok(Fitted {
        address,
        is_new: true,
    })
}

#[cfg(test)]
mod tests {
    use shaders::trace_types::BvhInstance;

    use super::*;
    use crate::gpu::{DeviceOptions, Instance, SurfaceSource};

    /// What the GPU has listed.
    fn listed<T: Pod + PartialEq>(device: &Device, kept: &mut Kept<T>) -> Vec<T> {
        device.immediate(|rec| kept.record(rec)).unwrap();
        let size = (kept.len() * size_of::<T>()) as u64;
        if size == 0 {
            return Vec::new();
        }
        let list = kept.list.clone().unwrap();
        let bytes = device.read_buffer(&list, 0, size).unwrap();
        bytemuck::pod_collect_to_vec(&bytes)
    }

    /// Lists `frames`, and compares them with what the CPU would have written; the records written for each.
    fn follow<T: Pod + PartialEq + std::fmt::Debug>(
        device: &Device,
        frames: &[Vec<(u32, T)>],
    ) -> Vec<u64> {
        let mut kept = Kept::new(device).unwrap();
        let each = frames.iter().map(|frame| {
            let before = kept.written;
            kept.take(frame.iter().copied());
            let expected: Vec<T> = frame.iter().map(|(_, record)| *record).collect();
            assert_eq!(listed(device, &mut kept), expected);
            kept.written - before
        });
        each.collect()
    }

    #[test]
    fn the_list_on_the_gpu_is_the_one_that_the_cpu_would_write() {
        let options = DeviceOptions {
            validation: true,
            ..DeviceOptions::default()
        };
        let made = Device::new(&options, SurfaceSource::Headless);
        let Some(device) = testkit::device(made) else {
            return;
        };
        let moved = |place: u32, x: f32| {
            let mut instance = Instance::new(u64::from(place) << 32 | 0x1234);
            instance.transform[0][3] = x;
            instance.custom_index = place;
            instance.mask = 0x5a;
            instance.cull_disable = true;
            (place, instance.words())
        };
        let all = |number: u32, x: f32| (0..number).map(|n| moved(n, x)).collect::<Vec<_>>();
        let mut one = all(3000, 0.0);
        one[7] = moved(7, 4.0);
        let left_out: Vec<_> = one.iter().copied().filter(|(n, _)| n % 3 != 0).collect();
        let mut turned = left_out.clone();
        turned.reverse();
        let frames = [
            all(3000, 0.0),
            all(3000, 0.0),
            one.clone(),
            left_out,
            turned,
            // places that were left out, a longer list in larger buffers, none
            one,
            all(9000, 0.0),
            Vec::new(),
            all(2, 1.0),
        ];
        let written = follow(&device, &frames);
        // in larger buffers all are written
        assert_eq!(written, [3000, 0, 1, 0, 0, 0, 9000, 0, 2]);
        let own = |place: u32| {
            let record = BvhInstance {
                nodes: u64::from(place),
                geometry: place,
                ..BvhInstance::default()
            };
            (place, record)
        };
        // more words than a row of the launch has
        let many: Vec<_> = (0..LIST_ROW / 16).map(own).collect();
        assert_eq!(follow(&device, &[many]), [u64::from(LIST_ROW / 16)]);
        assert_eq!(device.validation_messages(), Vec::<String>::new());
    }

    #[test]
    fn a_list_that_is_taken_again_does_not_differ() {
        let made = Device::new(&DeviceOptions::default(), SurfaceSource::Headless);
        let Some(device) = testkit::device(made) else {
            return;
        };
        let mut kept = Kept::new(&device).unwrap();
        let list = [(4, 1u32), (9, 2)];
        assert!(kept.take(list.into_iter()));
        device.immediate(|rec| kept.record(rec)).unwrap();
        assert!(!kept.take(list.into_iter()));
        assert!(kept.take([(4, 1)].into_iter()));
        device.immediate(|rec| kept.record(rec)).unwrap();
        assert!(kept.take([(4, 3)].into_iter()));
    }
}
