//! renderer_vk
