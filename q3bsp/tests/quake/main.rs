//! Maps of Quake, GoldSrc and Quake II: files made by the writer here, the writer held against the known layouts.

mod conversion;
mod damage;
#[path = "../common/exercise.rs"]
mod exercise;
mod layouts;
mod room;
