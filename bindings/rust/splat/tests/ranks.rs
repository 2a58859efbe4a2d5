//! Trainings of several ranks, which are threads here.

mod support;

use splat::{Code, Device, Ranks, RanksResult, RunEventKind, Training, TrainingDesc};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{channel, Receiver, Sender};
use std::time::Duration;
use support::{cars, device, Folder};

const CONFIG: &str = "model: {base_dim: 8, num_blocks: 1, channel_mult: [1, 2], \
                      attention_resolutions: [8]}\ndata: {training_resolution: 16}\n\
                      opt: {batch_size: 4, micro_batch: 1, imgs_per_obj: 2, iterations: 3}\n\
                      logging: {ckpt_iterations: 100, val_log: 0}\n";

/// How long a rank waits for another.
const LIMIT: Duration = Duration::from_secs(120);

/// A rank with a way to and from each other one; those of a rank that ends are closed.
struct Threads {
    rank: u32,
    to: Vec<Sender<Vec<u8>>>,
    from: Vec<Receiver<Vec<u8>>>,
    /// What becomes of an exchange of gradients.
    exchange: fn() -> RanksResult,
    sums: bool,
}

impl Threads {
    fn all(count: u32) -> Vec<Threads> {
        let mut to: Vec<Vec<Sender<Vec<u8>>>> = (0..count).map(|_| Vec::new()).collect();
        let mut from: Vec<Vec<Receiver<Vec<u8>>>> = (0..count).map(|_| Vec::new()).collect();
        for sender in &mut to {
            for receiver in &mut from {
                let (send, receive) = channel();
                sender.push(send);
                receiver.push(receive);
            }
        }
        to.into_iter()
            .zip(from)
            .zip(0..)
            .map(|((to, from), rank)| Threads { rank, to, from, exchange: || Ok(()), sums: false })
            .collect()
    }

    fn send(&self, peer: u32, data: &[u8]) -> RanksResult {
        self.to[peer as usize].send(data.to_vec()).map_err(|_| format!("rank {peer} has left"))
    }

    fn receive(&self, peer: u32, data: &mut [u8]) -> RanksResult {
        let found = self.from[peer as usize].recv_timeout(LIMIT);
        data.copy_from_slice(&found.map_err(|_| format!("rank {peer} has left"))?);
        Ok(())
    }

    fn others(&self) -> impl Iterator<Item = u32> {
        let rank = self.rank;
        (0..self.to.len() as u32).filter(move |&other| other != rank)
    }
}

impl Ranks for Threads {
    fn send_receive(&mut self, peer: u32, sent: &[u8], received: &mut [u8]) -> RanksResult {
        if sent.len() > 1000 {
            (self.exchange)()?;
        }
        self.send(peer, sent)?;
        self.receive(peer, received)
    }

    fn broadcast(&mut self, root: u32, data: &mut [u8]) -> RanksResult {
        if self.rank != root {
            return self.receive(root, data);
        }
        self.others().try_for_each(|other| self.send(other, data))
    }

    fn barrier(&mut self) -> RanksResult {
        self.others().try_for_each(|other| self.send(other, &[0]))?;
        self.others().try_for_each(|other| self.receive(other, &mut [0]))
    }

    fn sums(&self) -> bool {
        self.sums
    }

    fn sum(&mut self, values: &mut [f32]) -> RanksResult {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_ne_bytes()).collect();
        self.others().try_for_each(|other| self.send(other, &bytes))?;
        for other in self.others() {
            let mut share = vec![0; bytes.len()];
            self.receive(other, &mut share)?;
            for (value, part) in values.iter_mut().zip(share.chunks(4)) {
                *value += f32::from_ne_bytes([part[0], part[1], part[2], part[3]]);
            }
        }
        Ok(())
    }
}

fn data(folder: &Folder) -> String {
    format!("data.root='{}'", cars(folder, 4).display())
}

fn desc<'a>(folder: &'a Path, values: &'a [&'a str]) -> TrainingDesc<'a> {
    TrainingDesc { folder: Some(folder), config: Some(CONFIG), values, ..Default::default() }
}

/// What becomes of a rank's training: its last event.
type End = std::thread::Result<splat::Result<RunEventKind>>;

fn train(folder: &Path, root: &str, ranks: Vec<Threads>) -> Vec<End> {
    train_on(folder, root, ranks, || Device::create(&Default::default()))
}

fn train_on<D: std::borrow::Borrow<Device> + 'static>(
    folder: &Path,
    root: &str,
    ranks: Vec<Threads>,
    device: fn() -> splat::Result<D>,
) -> Vec<End> {
    let count = ranks.len() as u32;
    let run = move |each: Threads, folder: PathBuf, root: String| -> splat::Result<RunEventKind> {
        let device = device()?;
        let (values, place) = ([root.as_str()], (each.rank, count));
        let desc = desc(&folder, &values);
        let training = Training::open_with_ranks(device.borrow(), &desc, place, each)?;
        let mut last = RunEventKind::default();
        for event in training {
            last = event?.kind;
        }
        Ok(last)
    };
    let threads: Vec<_> = ranks
        .into_iter()
        .map(|each| {
            let (folder, root) = (folder.to_owned(), root.to_owned());
            std::thread::spawn(move || run(each, folder, root))
        })
        .collect();
    threads.into_iter().map(std::thread::JoinHandle::join).collect()
}

#[test]
fn two_ranks_have_the_bits_of_one() {
    let folder = Folder::new("ranks");
    let root = data(&folder);
    let (one, two) = (folder.join("one"), folder.join("two"));
    let alone = Training::open(device(), &desc(&one, &[&root])).unwrap();
    assert_eq!(alone.last().unwrap().unwrap().kind, RunEventKind::DONE);
    for kind in train(&two, &root, Threads::all(2)) {
        assert_eq!(kind.unwrap().unwrap(), RunEventKind::DONE);
    }
    let weights = |run: PathBuf| std::fs::read(run.join("weights_last.safetensors")).unwrap();
    assert!(weights(one) == weights(two));
}

#[test]
fn a_sum_without_order_is_used() {
    let folder = Folder::new("ranks_sum");
    let (root, run) = (data(&folder), folder.join("run"));
    let mut ranks = Threads::all(2);
    ranks.iter_mut().for_each(|each| each.sums = true);
    for kind in train(&run, &root, ranks) {
        assert_eq!(kind.unwrap().unwrap(), RunEventKind::DONE);
    }
    let facts = std::fs::read_to_string(run.join("run.json")).unwrap();
    assert!(facts.contains("\"reproducible\": false"), "{facts}");
}

#[test]
fn errors_and_panics_of_a_rank_end_the_training() {
    let folder = Folder::new("ranks_fail");
    let root = data(&folder);
    let mut ranks = Threads::all(2);
    ranks[1].exchange = || Err("unplugged".to_owned());
    let ends = train(&folder.join("error"), &root, ranks);
    let errors: Vec<_> = ends.into_iter().map(|end| end.unwrap().unwrap_err()).collect();
    assert!(errors[1].message().contains("unplugged"), "{}", errors[1]);
    assert_eq!(errors[1].code(), Code::Io);
    assert_eq!(errors[0].code(), Code::Io, "{}", errors[0]);

    let mut ranks = Threads::all(2);
    ranks[1].exchange = || panic!("mine");
    let mut ends = train(&folder.join("panic"), &root, ranks);
    let panic = ends.pop().unwrap().unwrap_err();
    assert_eq!(*panic.downcast::<&str>().unwrap(), "mine");
    assert_eq!(ends.pop().unwrap().unwrap().unwrap_err().code(), Code::Io);
}

#[test]
fn ranks_do_not_share_a_device() {
    let folder = Folder::new("ranks_device");
    let (root, run) = (data(&folder), folder.join("run"));
    for end in train_on(&run, &root, Threads::all(2), || Ok(device())) {
        let error = end.unwrap().unwrap_err();
        assert_eq!(error.code(), Code::InvalidArgument);
        assert!(error.message().contains("expected a device of its own"), "{error}");
    }
    assert!(!run.exists());
}

#[test]
fn numbers_that_are_no_ranks_are_refused() {
    let folder = Folder::new("ranks_bad");
    let root = data(&folder);
    let run = folder.join("run");
    for place in [(0, 3), (2, 2), (0, 0)] {
        let each = Threads::all(1).pop().unwrap();
        let made = Training::open_with_ranks(device(), &desc(&run, &[&root]), place, each);
        assert_eq!(made.unwrap_err().code(), Code::InvalidArgument, "{place:?}");
    }
    assert!(!run.exists());
}
