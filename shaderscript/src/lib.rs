//! shaderscript
