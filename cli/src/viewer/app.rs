//! The window of the viewer: events in, pictures out. What it shows is in [`super::state`].

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, anyhow};
use egui_winit::State as EguiState;
use gui::egui::ViewportId;
use renderer_vk::{Renderer, RendererOptions, Window as Surface};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Window, WindowId};

use super::state::{Frame, Start, Viewer};
use crate::pictures::write_rgb;

/// Time between looks at files and progress while the picture is at rest.
const REST: Duration = Duration::from_millis(200);

/// Options of the window and its device.
pub struct WindowOptions {
    /// Pixels.
    pub size: (u32, u32),
    /// Part of the device's name.
    pub device: Option<String>,
    /// Enables the validation layer.
    pub validation: bool,
    /// File for a picture of the window, after which the viewer ends.
    pub screenshot: Option<PathBuf>,
}

/// Shows the window until it is closed; returns the messages of the validation layer.
///
/// # Errors
/// There is no display or no Vulkan device, the map cannot be read, or the device is lost.
pub fn run(start: Start, options: WindowOptions) -> Result<Vec<String>> {
    let event_loop = EventLoop::<()>::with_user_event()
        .build()
        // its text names a file of a library
        .map_err(|_| {
            anyhow!(
                "no window: there is no display here; relight render makes pictures without one"
            )
        })?;
    let mut app = App {
        proxy: event_loop.create_proxy(),
        start: Some(start),
        options,
        open: None,
        outcome: Ok(()),
        messages: Vec::new(),
    };
    event_loop.run_app(&mut app).context("the window failed")?;
    app.outcome?;
    Ok(app.messages)
}

struct App {
    proxy: EventLoopProxy<()>,
    start: Option<Start>,
    options: WindowOptions,
    open: Option<Open>,
    outcome: Result<()>,
    messages: Vec<String>,
}

/// The open window.
struct Open {
    egui: EguiState,
    viewer: Viewer,
    window: Arc<Window>,
    last: Instant,
    /// When the picture changes without an event; `None`: at once.
    next: Option<Instant>,
}

impl Open {
    fn new(
        events: &ActiveEventLoop,
        start: Start,
        options: &WindowOptions,
        proxy: EventLoopProxy<()>,
    ) -> Result<Self> {
        let (width, height) = options.size;
        let attributes = Window::default_attributes()
            .with_title(format!(
                "{} – Relight",
                start.source.chosen.map.as_deref().unwrap_or("sample")
            ))
            .with_inner_size(PhysicalSize::new(width, height));
        let window = events
            .create_window(attributes)
            .context("the window could not be opened")?;
        let window = Arc::new(window);
        let size = window.inner_size();
        let renderer = Renderer::new(RendererOptions {
            window: Some(Surface::of(Arc::clone(&window))?),
            validation: options.validation,
            device: options.device.clone(),
            vsync: true,
            hdr: start.settings.hdr,
            pipeline_cache: Some(start.cache.join("pipelines.cache")),
            ..RendererOptions::headless(size.width.max(1), size.height.max(1))
        })
        .context("no picture without a Vulkan device")?;
        let wake = move || {
            // the loop may have ended
            let _ = proxy.send_event(());
        };
        let viewer = Viewer::new(renderer, start, Box::new(wake))?;
        let scale = Some(window.scale_factor() as f32);
        let context = viewer.context().clone();
        let egui = EguiState::new(context, ViewportId::ROOT, &window, scale, None, None);
        Ok(Self {
            egui,
            viewer,
            window,
            last: Instant::now(),
            next: None,
        })
    }

    /// Draws a frame. Returns whether the viewer has ended.
    fn draw(&mut self, options: &WindowOptions) -> Result<bool> {
        let now = Instant::now();
        let passed = now.duration_since(self.last);
        self.last = now;
        let input = self.egui.take_egui_input(&self.window);
        let Frame { output, at_rest } = self.viewer.frame(input, passed)?;
        if let Some(title) = self.viewer.take_title() {
            self.window.set_title(&title);
        }
        self.egui.handle_platform_output(&self.window, output);
        self.next = at_rest.then(|| now + REST);
        if let Some(path) = options
            .screenshot
            .as_ref()
            .filter(|_| self.viewer.is_ready())
        {
            let picture = self.viewer.picture()?;
            write_rgb(path, &picture.rgb, picture.width, picture.height)?;
            println!("{}", path.display());
            return Ok(true);
        }
        Ok(false)
    }
}

impl App {
    fn end(&mut self, events: &ActiveEventLoop, outcome: Result<()>) {
        if self.outcome.is_ok() {
            self.outcome = outcome;
        }
        if let Some(open) = self.open.take() {
            self.messages = open.viewer.end();
        }
        events.exit();
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let Some(start) = self.start.take() else {
            return; // the window is open
        };
        match Open::new(events, start, &self.options, self.proxy.clone()) {
            Ok(open) => {
                open.window.request_redraw();
                self.open = Some(open);
            }
            Err(e) => self.end(events, Err(e)),
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, (): ()) {
        if let Some(open) = &self.open {
            open.window.request_redraw();
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.open else {
            return;
        };
        let outcome = match &event {
            WindowEvent::CloseRequested => Ok(true),
            WindowEvent::Resized(size) => {
                let resized = open.viewer.resize(size.width, size.height);
                open.window.request_redraw();
                resized.map(|()| false)
            }
            WindowEvent::RedrawRequested => open.draw(&self.options),
            _ => {
                if open.egui.on_window_event(&open.window, &event).repaint {
                    open.window.request_redraw();
                }
                Ok(false)
            }
        };
        match outcome {
            Ok(false) => {}
            Ok(true) => self.end(events, Ok(())),
            Err(e) => self.end(events, Err(e)),
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        let Some(open) = &self.open else {
            return;
        };
        match open.next {
            None => {
                events.set_control_flow(ControlFlow::Poll);
                open.window.request_redraw();
            }
            Some(at) if at <= Instant::now() => open.window.request_redraw(),
            Some(at) => events.set_control_flow(ControlFlow::WaitUntil(at)),
        }
    }
}
