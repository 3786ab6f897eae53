//! What stands on the command line after the name of the program.

pub fn arguments() -> Vec<String> {
    std::env::args().skip(2).collect()
}

/// What follows this word.
pub fn argument(name: &str) -> Option<String> {
    arguments().into_iter().skip_while(|argument| argument != name).nth(1)
}

/// Whether this word is there.
pub fn flag(name: &str) -> bool {
    arguments().iter().any(|argument| argument == name)
}
