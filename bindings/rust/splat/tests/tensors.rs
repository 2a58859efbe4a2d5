//! Devices and tensors: values in and out, and bad input.

mod support;

use splat::{
    Access, Code, Device, DeviceDesc, DeviceSelect, Dtype, ExternalMemory, Features, Tensor, TensorDesc,
};
use support::device;

#[test]
fn devices_are_counted_and_described() {
    let count = Device::count().unwrap();
    assert!(count > 0);
    let info = Device::describe(0).unwrap();
    assert!(!info.name.is_empty() && info.usable, "{info:?}");
    let error = Device::describe(9999).unwrap_err();
    assert_eq!(error.code(), Code::InvalidArgument);
    assert!(error.message().contains("9999"), "{error}");
    assert!(error.to_string().starts_with("invalid argument: "), "{error}");
    assert!(device().get_memory().unwrap().budget_bytes > 0);
}

#[test]
fn a_device_that_does_not_exist_is_refused() {
    let desc = DeviceDesc { select: DeviceSelect::BY_INDEX, index: 77, ..Default::default() };
    assert!(Device::create(&desc).is_err());
    let desc = DeviceDesc { select: DeviceSelect(77), ..Default::default() };
    assert_eq!(Device::create(&desc).unwrap_err().code(), Code::InvalidArgument);
    let desc = DeviceDesc { cache_folder: Some("a\0b".into()), ..Default::default() };
    let error = Device::create(&desc).unwrap_err();
    assert!(error.message().contains("cache_folder") && error.message().contains("NUL"), "{error}");
}

#[test]
fn profiles_need_their_flag() {
    let error = device().profile_json().unwrap_err();
    assert_eq!(error.code(), Code::InvalidState);
    let flags = splat::DeviceFlags::PROFILE;
    let desc = DeviceDesc { flags, max_submit_ns: 50_000_000, ..Default::default() };
    let profiled = Device::create(&desc).unwrap();
    Tensor::from_slice(&profiled, &[4], &[1.0_f32; 4]).unwrap().check().unwrap();
    assert!(profiled.profile_json().unwrap().contains("tensor_stats"));
    assert!(profiled.profile_table().unwrap().contains("tensor_stats"));
    profiled.profile_reset().unwrap();
    assert!(!profiled.profile_json().unwrap().contains("tensor_stats"));
}

#[test]
fn values_come_back() {
    let values: Vec<f32> = (0..6).map(|i| i as f32).collect();
    let tensor = Tensor::from_slice(device(), &[2, 3], &values).unwrap();
    assert_eq!((tensor.dims(), tensor.dtype(), tensor.elements()), (&[2, 3][..], Dtype::F32, 6));
    assert_eq!(tensor.to_vec::<f32>().unwrap(), values);
    let mut columns = [0.0_f32; 6];
    tensor.read(&mut columns, Some(&[1, 2])).unwrap();
    assert_eq!(columns, [0.0, 3.0, 1.0, 4.0, 2.0, 5.0]);
    tensor.write(&[7.0_f32], Some(&[0, 0])).unwrap();
    assert_eq!(tensor.to_vec::<f32>().unwrap(), [7.0; 6]);
    let stats = tensor.check().unwrap();
    assert_eq!((stats.min, stats.max, stats.nan_count), (7.0, 7.0, 0));
    let numbers = Tensor::from_slice(device(), &[2], &[-1_i32, 5]).unwrap();
    assert_eq!(numbers.to_vec::<i32>().unwrap(), [-1, 5]);
    let scalar = Tensor::from_slice(device(), &[], &[9_u32]).unwrap();
    assert_eq!(scalar.to_vec::<u32>().unwrap(), [9]);
}

#[test]
fn names_and_shapes_are_told() {
    let desc =
        TensorDesc { name: Some("weights ü".into()), dims: vec![3, 1], ..Default::default() };
    let info = Tensor::create(device(), &desc).unwrap().get_info().unwrap();
    assert_eq!((info.name.as_str(), info.dims, info.bytes), ("weights ü", vec![3, 1], 12));
}

#[test]
fn slices_of_another_length_or_type_are_refused() {
    let tensor = Tensor::from_slice(device(), &[2, 2], &[1.0_f32; 4]).unwrap();
    for length in [0, 3, 5] {
        let error = tensor.read(&mut vec![0.0_f32; length], None).unwrap_err();
        assert_eq!(error.code(), Code::ShapeMismatch);
        assert!(error.message().contains(&length.to_string()), "{error}");
        assert!(tensor.write(&vec![0.0_f32; length], None).is_err());
    }
    let mut short = [5.0_f32; 3];
    let error = tensor.read(&mut short, Some(&[2, 1])).unwrap_err();
    assert_eq!((error.code(), short), (Code::InvalidArgument, [5.0; 3]));
    assert!(tensor.read(&mut [0.0_f32; 4], Some(&[1])).is_err());
    assert!(tensor.write(&[0.0_f32; 4], Some(&[-2, 1])).is_err());
    assert!(tensor.to_vec::<u32>().is_err());
    let desc = TensorDesc { dtype: Dtype::U32, dims: vec![1], ..Default::default() };
    assert!(Tensor::from_host(device(), &desc, &[1.0_f32], None).is_err());
    assert_eq!(tensor.to_vec::<f32>().unwrap(), [1.0; 4]);
}

#[test]
fn exported_memory_outlives_its_tensor() {
    let desc = TensorDesc { dims: vec![3], exportable: true, ..Default::default() };
    if !device().get_info().unwrap().features.contains(Features::EXTERNAL_MEMORY) {
        assert_eq!(Tensor::create(device(), &desc).unwrap_err().code(), Code::Unsupported);
        return;
    }
    let tensor = Tensor::create(device(), &desc).unwrap();
    tensor.write(&[1.0_f32, 2.0, 3.0], None).unwrap();
    let memory = tensor.export().unwrap();
    drop(tensor);
    // SAFETY: the size is the library's, and nobody else has the memory.
    let import = |memory| unsafe {
        Tensor::import(device(), &TensorDesc { exportable: false, ..desc.clone() }, memory)
    };
    let imported = import(&memory).unwrap();
    // SAFETY: the descriptor is ours.
    #[cfg(unix)]
    drop(unsafe { <std::fs::File as std::os::unix::io::FromRawFd>::from_raw_fd(memory.handle as i32) });
    assert_eq!(imported.to_vec::<f32>().unwrap(), [1.0, 2.0, 3.0]);
    assert_eq!(imported.export().unwrap_err().code(), Code::InvalidState);
    let error = import(&ExternalMemory { handle: -1, ..memory }).unwrap_err();
    assert_eq!(error.code(), Code::InvalidArgument, "{error}");
}

#[test]
fn impossible_shapes_are_refused() {
    for dims in [vec![1; 9], vec![-1], vec![0], vec![i64::MAX, 2], vec![1 << 31]] {
        let desc = TensorDesc { dims, ..Default::default() };
        assert!(Tensor::create(device(), &desc).is_err(), "{desc:?}");
        assert!(Tensor::from_host(device(), &desc, &[0.0_f32], None).is_err(), "{desc:?}");
    }
}

#[test]
fn mappings_hold_off_other_calls() {
    let tensor = Tensor::from_slice(device(), &[3], &[1.0_f32, 2.0, 3.0]).unwrap();
    let refused = |error: splat::Error, code| assert_eq!(error.code(), code, "{error}");
    let mut mapping = tensor.map_mut::<f32>(Access::READ_WRITE).unwrap();
    assert_eq!(*mapping, [1.0, 2.0, 3.0]);
    assert_eq!(format!("{mapping:?}"), "[1.0, 2.0, 3.0]");
    refused(tensor.to_vec::<f32>().unwrap_err(), Code::InvalidState);
    refused(tensor.map::<f32>().unwrap_err(), Code::InvalidState);
    mapping[1] = 9.0;
    mapping.unmap().unwrap();
    assert_eq!(tensor.to_vec::<f32>().unwrap(), [1.0, 9.0, 3.0]);
    let mapping = tensor.map::<f32>().unwrap();
    assert_eq!(mapping.iter().sum::<f32>(), 13.0);
    drop(mapping);
    refused(tensor.map::<i32>().unwrap_err(), Code::InvalidArgument);
    for access in [Access::READ, Access(9)] {
        let error = tensor.map_mut::<f32>(access).unwrap_err();
        refused(error, Code::InvalidArgument);
    }
    let access = Access::READ_WRITE;
    refused(tensor.map_mut::<i32>(access).unwrap_err(), Code::InvalidArgument);
    tensor.write(&[0.0_f32; 3], None).unwrap();
}

#[test]
fn memory_of_the_host_is_shared_where_the_device_can() {
    let tensor = Tensor::from_slice(device(), &[2], &[3.0_f32, 4.0]).unwrap();
    let features = device().get_info().unwrap().features;
    match tensor.host_pointer() {
        Ok((pointer, bytes)) => {
            assert_eq!(bytes, 8);
            // SAFETY: no other call uses the tensor.
            assert_eq!(unsafe { *pointer.cast::<f32>().add(1) }, 4.0);
            assert!(!tensor.to_dlpack().unwrap().is_null());
        }
        Err(error) => {
            assert_eq!(error.code(), Code::Unsupported);
            assert!(!features.contains(splat::Features::UNIFIED_MEMORY));
        }
    }
}
