//! q3model
