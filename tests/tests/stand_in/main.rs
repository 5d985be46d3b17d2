//! The library in the stand-in engine: every entry point with its result checked, both looks, the life of a session.

#![forbid(unsafe_code)]

mod answers;
mod captures;
mod game;
mod odd_engines;
mod pictures;
mod player;
mod quake3e;
mod session;
mod support;
mod tremulous;
mod views;
