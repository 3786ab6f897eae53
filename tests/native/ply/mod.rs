//! PLY reading and writing, on real files, on files made here, and on broken ones.

mod broken_files;
mod known_files;
mod random_files;
mod rules;
mod texts;
mod values;
