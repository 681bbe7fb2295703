//! The two writers of a document.

pub mod html;
pub mod markdown;
