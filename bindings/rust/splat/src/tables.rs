//! Data sets as tables in Parquet files, and in other layouts.

use std::any::Any;
use std::os::raw::c_void;
use std::panic::{catch_unwind, resume_unwind, AssertUnwindSafe};

use crate::error::{call, Result};
use crate::text::{array, c_optional, c_optional_path, pointer};
use crate::values::ImportFlags;
use crate::Dataset;
use splat_sys as sys;
use std::path::Path;

/// Called with the rows done and the rows of all tables; false ends the call with
/// [`Code::Cancelled`](crate::Code::Cancelled). What was done is kept for the next call.
pub type Progress<'a> = &'a mut dyn FnMut(u64, u64) -> bool;

/// Which tables to import, and where.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImportDesc<'a> {
    /// Replace an import of other tables.
    pub flags: ImportFlags,
    /// Folder of the tables.
    pub path: Option<&'a Path>,
    /// Folder of the store; None: where [`Dataset::open`] of the tables looks.
    pub out: Option<&'a Path>,
    /// "train", "val", "test"; None: train.
    pub split: Option<&'a str>,
    /// DuckDB's library; None: SPLAT_DUCKDB_LIBRARY, or found.
    pub duckdb: Option<&'a Path>,
    /// Parts of the work, which as many processes do; the last to end completes the store. 0: 1.
    pub shards: u32,
    /// The part that this call does, from 0.
    pub shard: u32,
}

/// What of a data set to write, and how.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExportDesc<'a> {
    /// The folder to write to.
    pub path: Option<&'a Path>,
    /// "tables", "srn", "images", "store"; None: tables.
    pub layout: Option<&'a str>,
    /// Split to write; None: that of the data set.
    pub split: Option<&'a str>,
    /// In names of folders and configurations; None: cars.
    pub category: Option<&'a str>,
    /// DuckDB's library; None: SPLAT_DUCKDB_LIBRARY, or found.
    pub duckdb: Option<&'a Path>,
    /// Numbers of objects; None: all.
    pub objects: Option<&'a [u32]>,
    /// Parts of a store, see [`ImportDesc`].
    pub shards: u32,
    /// The part to write, see [`ImportDesc`].
    pub shard: u32,
}

/// What the trampoline needs: the callback, and the panic that it stopped.
struct Call<'a> {
    progress: Progress<'a>,
    panic: Option<Box<dyn Any + Send>>,
}

unsafe extern "C" fn trampoline(user: *mut c_void, done: u64, total: u64) -> i32 {
    // SAFETY: `run` passes its own Call, which lives through the call of the library.
    let call = unsafe { &mut *user.cast::<Call<'_>>() };
    match catch_unwind(AssertUnwindSafe(|| (call.progress)(done, total))) {
        Ok(more) => i32::from(!more),
        Err(panic) => {
            call.panic = Some(panic);
            1
        }
    }
}

/// Run a function of the library with a progress; a panic of it goes on when that has returned.
fn run(
    progress: Option<Progress<'_>>,
    function: impl FnOnce(sys::splat_progress_callback, *mut c_void) -> Result<()>,
) -> Result<()> {
    let progress = match progress {
        Some(progress) => progress,
        None => return function(None, std::ptr::null_mut()),
    };
    let mut call = Call { progress, panic: None };
    let result = function(Some(trampoline), (&mut call as *mut Call<'_>).cast());
    if let Some(panic) = call.panic {
        resume_unwind(panic);
    }
    result
}

/// Copy a split of tables in Parquet files to a store, which [`Dataset::open`] reads fast.
/// # Errors
/// `NotFound` (tables, DuckDB), `Format` with table, column and row, `Io`, `InvalidState`.
pub fn import_tables(desc: &ImportDesc<'_>, progress: Option<Progress<'_>>) -> Result<()> {
    let path = c_optional_path("path", desc.path)?;
    let out = c_optional_path("out", desc.out)?;
    let split = c_optional("split", desc.split)?;
    let duckdb = c_optional_path("duckdb", desc.duckdb)?;
    let raw = sys::splat_dataset_import_desc {
        flags: desc.flags.0,
        path: pointer(&path),
        out: pointer(&out),
        split: pointer(&split),
        duckdb: pointer(&duckdb),
        shards: desc.shards,
        shard: desc.shard,
        ..Default::default()
    };
    run(progress, |callback, user| call!(splat_dataset_import(&raw, callback, user)))
}

impl Dataset {
    /// Write objects with their cameras, images and maps, as 8 bits at the data set's resolution.
    /// # Errors
    /// `InvalidArgument` (another export in the folder), `Unsupported`, `NotFound`, `Io`.
    pub fn export(&self, desc: &ExportDesc<'_>, progress: Option<Progress<'_>>) -> Result<()> {
        let path = c_optional_path("path", desc.path)?;
        let layout = c_optional("layout", desc.layout)?;
        let split = c_optional("split", desc.split)?;
        let category = c_optional("category", desc.category)?;
        let duckdb = c_optional_path("duckdb", desc.duckdb)?;
        let (objects, object_count) = array("objects", desc.objects)?;
        let raw = sys::splat_dataset_export_desc {
            path: pointer(&path),
            layout: pointer(&layout),
            split: pointer(&split),
            category: pointer(&category),
            duckdb: pointer(&duckdb),
            objects,
            object_count,
            shards: desc.shards,
            shard: desc.shard,
            ..Default::default()
        };
        run(progress, |callback, user| {
            call!(splat_dataset_export(self.handle, &raw, callback, user))
        })
    }
}
