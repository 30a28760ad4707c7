//! The panel in a window.

use eframe::glow::{self, HasContext as _};
use haptic_panel::{App, theme};
use raw_window_handle::{HasWindowHandle as _, RawWindowHandle};

/// What renderers call themselves that draw without a graphics card: those of Mesa and of Chromium.
const IN_SOFTWARE: [&str; 4] = ["llvmpipe", "softpipe", "Software Rasterizer", "SwiftShader"];

/// Whether a window is drawn by the processor.
#[expect(unsafe_code, reason = "what a renderer calls itself has no safe wrapper")]
pub(crate) fn is_drawn_in_software(creation: &eframe::CreationContext<'_>) -> bool {
    let name = creation.gl.as_ref().map(|gl| {
        // SAFETY: the context is that of this thread while the window is created.
        unsafe { gl.get_parameter_string(glow::RENDERER) }
    });
    name.is_some_and(|name| IN_SOFTWARE.iter().any(|renderer| name.contains(renderer)))
}

/// The number of a window under X11; `None` elsewhere.
pub(crate) fn x11_window(creation: &eframe::CreationContext<'_>) -> Option<u32> {
    match creation.window_handle().ok()?.as_raw() {
        RawWindowHandle::Xlib(window) => u32::try_from(window.window).ok(),
        RawWindowHandle::Xcb(window) => Some(window.window.get()),
        _ => None,
    }
}

/// The panel as the windowing system calls it.
pub(crate) struct Window {
    pub(crate) app: App,
    pub(crate) ctx: egui::Context,
}

impl eframe::App for Window {
    fn raw_input_hook(&mut self, _: &egui::Context, input: &mut egui::RawInput) {
        self.app.take_keys(input);
    }

    fn logic(&mut self, ctx: &egui::Context, _: &mut eframe::Frame) {
        self.app.take_news(ctx);
    }

    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        self.app.show(ui);
    }

    fn on_exit(&mut self, _: Option<&eframe::glow::Context>) {
        self.app.close(&self.ctx);
    }

    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        theme::ground(visuals).to_normalized_gamma_f32()
    }
}
