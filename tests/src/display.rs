//! A display of one's own for renderers that want a window: a private Xvfb.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use crate::data;

/// The running server. It ends when this is dropped.
pub struct Display {
    server: Child,
    /// What `DISPLAY` has to be.
    pub name: String,
}

impl Display {
    /// Starts a server; `None`, with a report of a skipped test, where Xvfb is not installed.
    ///
    /// # Panics
    /// When it is installed and does not start.
    pub fn start() -> Option<Self> {
        let program = data::tool("Xvfb")?;
        // It picks a free number itself and writes it once it accepts clients.
        let mut server = Command::new(program)
            .args(["-displayfd", "1", "-screen", "0", "2560x1600x24"])
            .args(["-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb starts");
        let mut number = String::new();
        let pipe = server.stdout.take().expect("the pipe of Stdio::piped");
        let read = BufReader::new(pipe).read_line(&mut number);
        let display = Self {
            server,
            name: format!(":{}", number.trim()),
        };
        assert!(
            read.is_ok() && !number.trim().is_empty(),
            "Xvfb did not start"
        );
        Some(display)
    }

    /// Sets this display for a program to be started; Mesa's software OpenGL draws its windows.
    pub fn lend_to(&self, program: &mut Command) {
        program
            .env("DISPLAY", &self.name)
            .env("SDL_VIDEODRIVER", "x11")
            .env("LIBGL_ALWAYS_SOFTWARE", "1")
            .env_remove("WAYLAND_DISPLAY");
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
