//! The functions that all engines call with the same types.

/// An engine's table of exports: its own fields as given, the others with the shared functions.
macro_rules! exports {
    ($table:ident { $($field:ident: $function:expr),* $(,)? }) => {
        $table {
            $($field: $function,)*
            RegisterModel: $crate::scene::register_model,
            RegisterSkin: $crate::scene::register_skin,
            RegisterShader: $crate::scene::register_shader,
            RegisterShaderNoMip: $crate::scene::register_shader_no_mip,
            LoadWorld: $crate::scene::load_world,
            SetWorldVisData: $crate::scene::set_world_vis_data,
            EndRegistration: $crate::lifecycle::end_registration,
            ClearScene: $crate::scene::clear_scene,
            AddPolyToScene: $crate::scene::add_poly,
            LightForPoint: $crate::queries::light_for_point,
            AddLightToScene: $crate::scene::add_light,
            AddAdditiveLightToScene: $crate::scene::add_additive_light,
            RenderScene: $crate::scene::render_scene,
            SetColor: $crate::scene::set_color,
            DrawStretchPic: $crate::scene::stretch_pic,
            DrawStretchRaw: $crate::scene::stretch_raw,
            UploadCinematic: $crate::scene::upload_cinematic,
            BeginFrame: $crate::lifecycle::begin_frame,
            EndFrame: $crate::lifecycle::end_frame,
            MarkFragments: $crate::queries::mark_fragments,
            LerpTag: $crate::queries::lerp_tag,
            ModelBounds: $crate::queries::model_bounds,
            RegisterFont: $crate::scene::register_font,
            RemapShader: $crate::queries::remap_shader,
            GetEntityToken: $crate::queries::get_entity_token,
            inPVS: $crate::queries::in_pvs,
            TakeVideoFrame: $crate::lifecycle::take_video_frame,
        }
    };
}
pub(crate) use exports;
