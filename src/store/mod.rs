//! What is kept outside of memory: a page file for what does not fit in, while the process lives.

pub mod page_file;
