//! Data sets, batches, trainers and trainings.

mod support;

use splat::{
    config, image, Batches, Code, DataFlags, Dataset, DatasetDesc, DatasetViews, ExportDesc,
    ImageView, ImportDesc, RunEventKind, Trainer, Training, TrainingDesc, TrainingFlags,
};
use support::{cars, device, Folder};

const CONFIG: &str = "model: {base_dim: 8, num_blocks: 1, channel_mult: [1, 2], \
                      attention_resolutions: [8]}\ndata: {training_resolution: 16}\n\
                      opt: {batch_size: 1, imgs_per_obj: 2, iterations: 4}\n\
                      logging: {ckpt_iterations: 2, val_log: 0}\n";

#[test]
fn configurations_are_merged_and_checked() {
    let merged = config::merge(Some(CONFIG), &["opt.base_lr=1e-4"]).unwrap();
    assert!(merged.contains("\"base_lr\": 0.0001"), "{merged}");
    assert!(config::keys().unwrap().contains("opt.base_lr"));
    assert!(config::check(Some(CONFIG), &[]).unwrap().contains("warnings"));
    let error = config::merge(None, &["opt.base_lrr=1"]).unwrap_err();
    assert!(error.message().contains("opt.base_lr"), "{error}");
    assert!(config::merge(Some("opt: ["), &[]).is_err());
    assert!(config::merge(Some("a\0"), &[]).unwrap_err().message().contains("config"));
}

#[test]
fn a_data_set_is_exported() {
    let folder = Folder::new("export");
    let (path, out) = (cars(&folder, 2), folder.join("out"));
    assert_eq!(splat::path_name("../a/b").unwrap(), "%2E.%2Fa%2Fb");
    let dataset = Dataset::open(&DatasetDesc { path: Some(&path), ..Default::default() }).unwrap();
    let desc = ExportDesc {
        path: Some(&out),
        layout: Some("store"),
        objects: Some(&[1]),
        ..Default::default()
    };
    let stopped = dataset.export(&desc, Some(&mut |_, _| false)).unwrap_err();
    assert_eq!(stopped.code(), Code::Cancelled, "{stopped}");
    let panic =
        std::panic::catch_unwind(|| dataset.export(&desc, Some(&mut |_, _| panic!("mine"))));
    assert_eq!(*panic.unwrap_err().downcast::<&str>().unwrap(), "mine");
    let mut last = (0, 0);
    let mut progress = |done, total| {
        last = (done, total);
        true
    };
    dataset.export(&desc, Some(&mut progress)).unwrap();
    assert_eq!(last, (20, 20)); // 4 views: poses, images and three maps
    let store = Dataset::open(&DatasetDesc { path: Some(&out), ..Default::default() }).unwrap();
    assert!(store.report().unwrap().contains("\"format\": \"store\""));
    let parts = folder.join("parts");
    for shard in [1, 0] {
        let part = ExportDesc {
            path: Some(&parts),
            layout: Some("store"),
            shards: 2,
            shard,
            ..Default::default()
        };
        dataset.export(&part, None).unwrap();
    }
    assert!(folder.join("parts/train/store.json").exists());
    let tables = ImportDesc { path: Some(&path), ..Default::default() };
    let missing = splat::import_tables(&tables, None).unwrap_err();
    assert!(missing.message().contains("lacks tables"), "{missing}");
}

#[test]
fn views_of_a_data_set_are_read() {
    let folder = Folder::new("views");
    let path = cars(&folder, 2);
    let dataset = Dataset::open(&DatasetDesc { path: Some(&path), ..Default::default() }).unwrap();
    assert!(dataset.report().unwrap().contains("\"objects\": 2"));
    assert!(dataset.check(1).unwrap().contains("\"problems\": []"));
    let (mut images, mut focals) = (vec![-1.0; 2 * 3 * 16 * 16], vec![0.0; 4]);
    let mut views =
        DatasetViews { images: Some(&mut images), focals: Some(&mut focals), ..Default::default() };
    dataset.read(0, &[0, 3], &mut views).unwrap();
    assert!(images.iter().all(|value| (0.0..=1.0).contains(value)));
    assert!(focals.iter().all(|&focal| focal > 0.0));
    let mut short = vec![-1.0; 5];
    let mut views = DatasetViews { images: Some(&mut short), ..Default::default() };
    let error = dataset.read(0, &[0], &mut views).unwrap_err();
    assert_eq!(error.code(), Code::InvalidArgument, "{error}");
    assert_eq!(short, [-1.0; 5]);
    let mut views = DatasetViews { images: Some(&mut []), ..Default::default() };
    assert!(dataset.read(0, &[0], &mut views).unwrap_err().message().contains("images"));
    assert!(dataset.read(9, &[0], &mut DatasetViews::default()).is_err());
    assert!(dataset.read(0, &[99], &mut DatasetViews::default()).is_err());
    let none = Dataset::open(&DatasetDesc { path: Some("no/such".as_ref()), ..Default::default() });
    assert_eq!(none.unwrap_err().code(), Code::NotFound);
}

#[test]
fn planes_of_a_data_set_are_read() {
    let folder = Folder::new("planes");
    let path = cars(&folder, 1);
    let object = path.join("srn_cars/cars_train/000000_car");
    let map: Vec<u8> = [[255, 128, 128, 255].repeat(64), [0; 4].repeat(192)].concat();
    std::fs::create_dir(object.join("plane")).unwrap();
    for picture in std::fs::read_dir(object.join("rgb")).unwrap() {
        let to = object.join("plane").join(picture.unwrap().file_name());
        image::save(to, ImageView::new(&map, [16, 16], 4).unwrap()).unwrap();
    }
    let desc = DatasetDesc { path: Some(&path), flags: DataFlags::PLANE, ..Default::default() };
    let mut planes = vec![-1.0; 5 * 256];
    let mut views = DatasetViews { planes: Some(&mut planes), ..Default::default() };
    Dataset::open(&desc).unwrap().read(0, &[1], &mut views).unwrap();
    assert_eq!([planes[0], planes[3 * 256], planes[4 * 256]], [1.0; 3]);
    assert_eq!(planes[4 * 256 + 64..], [0.0; 192]);
}

#[test]
fn a_trainer_resumes_with_the_same_bits() {
    let folder = Folder::new("trainer");
    let path = cars(&folder, 2);
    let config = config::merge(Some(CONFIG), &[]).unwrap();
    let desc = DatasetDesc {
        path: Some(&path),
        resolution: 16,
        background: [1.0; 3],
        ..Default::default()
    };
    let dataset = Dataset::open(&desc).unwrap();
    let mut batches = Batches::create(&dataset, Some(&config), 7).unwrap();
    drop(dataset);
    let trainer = Trainer::create(device(), Some(&config)).unwrap();
    trainer.model().unwrap().init(5).unwrap();
    let info = trainer.step(&batches.next(0).unwrap()).unwrap();
    assert!(info.step == 1 && info.loss > 0.0 && !info.skipped, "{info:?}");
    trainer.save(folder.join("state.safetensors")).unwrap();
    let state = trainer.save_memory().unwrap();
    assert_eq!(std::fs::read(folder.join("state.safetensors")).unwrap(), state);
    let second = Trainer::create(device(), Some(&config)).unwrap();
    second.resume_memory(&state).unwrap();
    let batch = batches.next(1).unwrap();
    assert_eq!(batch.targets.unwrap().len(), 2 * 3 * 16 * 16);
    let losses = [&trainer, &second].map(|trainer| trainer.step(&batch).unwrap().loss);
    assert_eq!(losses[0].to_bits(), losses[1].to_bits());
    let error = second.step(&Default::default()).unwrap_err();
    assert_eq!(error.code(), Code::InvalidArgument, "{error}");
    let mut wrong = batch;
    wrong.targets = Some(&batch.targets.unwrap()[1..]);
    assert_eq!(second.step(&wrong).unwrap_err().code(), Code::ShapeMismatch);
    assert_eq!(second.resume_memory(&state[1..]).unwrap_err().code(), Code::Format);
    assert_eq!(second.resume("no.safetensors").unwrap_err().code(), Code::NotFound);
    assert!(second.store().unwrap().count().unwrap() > 0);
    assert!(second.report().unwrap().contains("\"attempts\": 2"));
}

#[test]
fn a_training_is_an_iterator_of_events() {
    let folder = Folder::new("training");
    let (root, run) = (format!("data.root='{}'", cars(&folder, 2).display()), folder.join("run"));
    let desc = TrainingDesc {
        folder: Some(&run),
        config: Some(CONFIG),
        values: &[&root],
        ..Default::default()
    };
    let events: Vec<_> =
        Training::open(device(), &desc).unwrap().collect::<splat::Result<_>>().unwrap();
    let steps = events.iter().filter(|event| event.kind == RunEventKind::STEP);
    assert_eq!(steps.map(|event| event.step).max(), Some(4));
    assert!(events.iter().any(|event| event.numbers.get("loss") > Some(&0.0)));
    let last = events.last().unwrap();
    assert!(last.is_end() && last.kind == RunEventKind::DONE, "{last:?}");
    assert!(events.iter().any(|event| event.text.is_some()));
    let error = Training::open(device(), &desc).unwrap_err();
    assert_eq!(error.code(), Code::InvalidState, "{error}");
    let resume = TrainingDesc {
        flags: TrainingFlags::RESUME,
        values: &["opt.iterations=5"],
        config: None,
        ..desc
    };
    let mut more = Training::open(device(), &resume).unwrap();
    let locked = Training::open(device(), &resume).unwrap_err();
    assert_eq!(locked.code(), Code::InvalidState, "{locked}");
    assert_eq!(more.by_ref().last().unwrap().unwrap().step, 5);
    assert!(more.next().is_none());
    assert!(more.model().unwrap().get_info().unwrap().parameters > 0);
    assert!(more.report().unwrap().contains("\"step\": 5"));
    assert_eq!(more.last_step().unwrap().step, 5);
}

#[test]
fn another_thread_interrupts_a_training() {
    let folder = Folder::new("interrupt");
    let (root, run) = (format!("data.root='{}'", cars(&folder, 2).display()), folder.join("run"));
    let values = [root.as_str(), "opt.iterations=100000"];
    let desc = TrainingDesc {
        folder: Some(&run),
        config: Some(CONFIG),
        values: &values,
        ..Default::default()
    };
    let mut training = Training::open(device(), &desc).unwrap();
    let interrupter = training.interrupter();
    let mut thread = None;
    let mut last = None;
    for event in training.by_ref() {
        let event = event.unwrap();
        if event.kind == RunEventKind::STEP && thread.is_none() {
            thread = Some(std::thread::spawn(move || interrupter.interrupt()));
        }
        last = Some(event.kind);
    }
    thread.unwrap().join().unwrap().unwrap();
    assert_eq!(last, Some(RunEventKind::INTERRUPTED));
    drop(training);
    assert_eq!(interrupter.interrupt().unwrap_err().code(), Code::InvalidHandle);
}

#[test]
fn bad_trainings_are_refused() {
    let folder = Folder::new("bad_trainings");
    let run = folder.join("run");
    let open = |config, values: &[&str]| {
        let desc = TrainingDesc { folder: Some(&run), config, values, ..Default::default() };
        Training::open(device(), &desc).unwrap_err()
    };
    assert_eq!(open(None, &["data.root=no/such"]).code(), Code::NotFound);
    assert_eq!(open(Some("opt: 3"), &[]).code(), Code::InvalidArgument);
    assert!(!folder.join("run").exists());
    assert!(Trainer::create(device(), Some("model: {base_dim: 7}")).is_err());
}
