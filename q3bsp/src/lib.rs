//! q3bsp
