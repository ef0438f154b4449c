//! A glTF file with its buffers.

use super::container::Container;
use super::data_uri::{self, Content};
use super::faults::Faults;
use super::named_extensions::{self, NamedExtensions};
use crate::scene::find_file::Finder;
use crate::scene::input;
use crate::scene::report::Report;
use ::gltf::json::{Buffer, Index, Root, buffer};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A file that was read.
#[derive(Debug)]
pub(super) struct Document {
    /// Where it is.
    pub path: PathBuf,
    /// What it says. Nothing in it is to be trusted: indices may lead nowhere, numbers may be no numbers.
    pub root: Root,
    /// Which extensions it names.
    pub names: NamedExtensions,
    /// The file, where it is a binary one.
    bytes: Vec<u8>,
    /// Its buffers, or why they cannot be used.
    buffers: Vec<Result<Bytes, String>>,
    /// Images that stand in the text, or why they cannot be used.
    images: Vec<Option<Result<Vec<u8>, String>>>,
    /// Files of buffers.
    pub files: Vec<PathBuf>,
}

#[derive(Debug)]
enum Bytes {
    Within(Range<usize>),
    Own(Vec<u8>),
}

/// Where an image is.
pub(super) enum Image<'d> {
    /// In a file of this name.
    File(&'d str),
    /// Here.
    Bytes(&'d [u8]),
}

impl Document {
    /// Reads a file with its buffers; `Err` where nothing can be made of it, as a report of the file.
    pub(super) fn read(path: &Path) -> Result<Self, Report> {
        let refuse = |line, why: String| {
            let mut report = Report::default();
            report.error(path, line, why);
            report
        };
        let bytes = input::read_binary(path).map_err(|why| refuse(None, why))?;
        let container = Container::of(&bytes).map_err(|why| refuse(None, why))?;
        let (mut root, names) = container.parse(&bytes).map_err(|(line, why)| refuse(line, why))?;
        let refusals = root.extensions_required.iter().filter_map(|name| named_extensions::refusal(name));
        let mut report = Report::default();
        refusals.for_each(|why| report.error(path, None, why));
        if report.has_errors() {
            return Err(report);
        }
        let mut files = Vec::new();
        let mut finder = Finder::default();
        let mut buffers = Vec::new();
        for (number, buffer) in root.buffers.iter_mut().enumerate() {
            let bin = container.bin.clone().filter(|_| number == 0);
            buffers.push(read_buffer(path, &mut finder, buffer, bin, &mut files));
        }
        let embedded = |image: &mut ::gltf::json::Image| match data_uri::content(image.uri.as_deref()?) {
            Ok(Content::File) => None,
            Ok(Content::Bytes(bytes)) => {
                image.uri = None;
                Some(Ok(bytes))
            }
            Err(why) => Some(Err(why)),
        };
        let images = root.images.iter_mut().map(embedded).collect();
        let bytes = if container.is_text { Vec::new() } else { bytes };
        Ok(Self { path: path.to_owned(), root, names, bytes, buffers, images, files })
    }

    /// The bytes of a buffer; none where it cannot be used.
    pub(super) fn buffer(&self, index: usize) -> &[u8] {
        match self.buffers.get(index) {
            Some(Ok(Bytes::Within(range))) => self.bytes.get(range.clone()).unwrap_or_default(),
            Some(Ok(Bytes::Own(bytes))) => bytes,
            Some(Err(_)) | None => &[],
        }
    }

    /// Where the bytes of a view are in its buffer.
    pub(super) fn view(&self, view: Index<buffer::View>) -> Result<(usize, Range<usize>), String> {
        let number = view.value();
        let found = self.root.buffer_views.get(number).ok_or(format!("there is no buffer view {number}"))?;
        if self.names.buffer_views.get(number).is_some_and(|names| names.has("EXT_meshopt_compression")) {
            return Err(format!("buffer view {number} is compressed by meshopt: export it without compression"));
        }
        let buffer = found.buffer.value();
        match self.buffers.get(buffer) {
            None => return Err(format!("buffer view {number}: there is no buffer {buffer}")),
            Some(Err(why)) => return Err(format!("buffer {buffer} {why}")),
            Some(Ok(_)) => {}
        }
        let there = self.buffer(buffer).len();
        let start = found.byte_offset.map_or(0, |offset| offset.0);
        let end = start.checked_add(found.byte_length.0).filter(|&end| end <= there as u64);
        let Some(end) = end else {
            let length = found.byte_length.0;
            return Err(format!(
                "buffer view {number} goes beyond its buffer: {length} bytes from {start} on, of {there}"
            ));
        };
        Ok((buffer, start as usize..end as usize))
    }

    /// Where an image is, or why it cannot be used.
    pub(super) fn image(&self, number: usize) -> Result<Image<'_>, String> {
        let image = self.root.images.get(number).ok_or(format!("there is no image {number}"))?;
        match (self.images.get(number), image.buffer_view, &image.uri) {
            (Some(Some(Ok(bytes))), ..) => Ok(Image::Bytes(bytes)),
            (Some(Some(Err(why))), ..) => Err(format!("image {number} {why}")),
            (_, Some(view), _) => {
                let (buffer, range) = self.view(view)?;
                Ok(Image::Bytes(&self.buffer(buffer)[range]))
            }
            (_, None, Some(name)) => Ok(Image::File(name)),
            (_, None, None) => Err(format!("image {number} has neither uri nor bufferView")),
        }
    }

    /// Says which faults of a buffer do not matter, as nothing uses it.
    pub(super) fn warn_of_buffers(&self, faults: &mut Faults) {
        for (number, why) in self.buffers.iter().enumerate().filter_map(|(k, b)| Some((k, b.as_ref().err()?))) {
            if self.root.buffer_views.iter().all(|view| view.buffer.value() != number) {
                faults.warn("buffers", format!("buffer {number} {why}"));
            }
        }
    }
}

/// The bytes of a buffer, as many as it says; `bin` are those of the file itself.
fn read_buffer(
    path: &Path,
    finder: &mut Finder,
    buffer: &mut Buffer,
    bin: Option<Range<usize>>,
    files: &mut Vec<PathBuf>,
) -> Result<Bytes, String> {
    let length = buffer.byte_length.0;
    let cut = |there: usize| {
        usize::try_from(length)
            .ok()
            .filter(|&length| length <= there)
            .ok_or(format!("is cut off: {there} of {length} bytes are there"))
    };
    let Some(uri) = buffer.uri.take() else {
        let bin = bin.ok_or("has no uri, and there is no binary part")?;
        return Ok(Bytes::Within(bin.start..bin.start + cut(bin.len())?));
    };
    let mut bytes = match data_uri::content(&uri)? {
        Content::Bytes(bytes) => bytes,
        Content::File => {
            let directory = path.parent().unwrap_or(Path::new(""));
            let found = finder.file(directory, &uri).ok_or(format!("is in a file that is not there: {uri:?}"))?;
            files.push(found.clone());
            input::read_binary(&found).map_err(|why| format!("is in {uri:?}, which {why}"))?
        }
    };
    bytes.truncate(cut(bytes.len())?);
    Ok(Bytes::Own(bytes))
}
