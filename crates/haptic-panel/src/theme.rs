//! Colours and sizes, as data: one palette for each theme.

use egui::{Color32, FontFamily, FontId, TextStyle, Ui, Visuals};
use haptic_ipc::RigState;

/// The colours that have a meaning. Each is used beside a text with the same meaning.
#[derive(Debug)]
pub(crate) struct Palette {
    /// No force, nothing wrong.
    pub(crate) rest: Color32,
    /// Force on the hand.
    pub(crate) live: Color32,
    /// On the way from one to the other, or a caution.
    pub(crate) caution: Color32,
    /// Stopped, faulted, and the button that stops.
    pub(crate) halt: Color32,
    /// Text on any of these.
    pub(crate) on_fill: Color32,
    /// Text that reports a fault or a refusal, on the panel's background.
    pub(crate) error_text: Color32,
    /// Text that asks for attention, on the panel's background.
    pub(crate) caution_text: Color32,
    /// The device, and the force on the hand.
    pub(crate) device: Color32,
    /// The block, and the force in its coupling.
    pub(crate) block: Color32,
    /// The law's force of a steady slide.
    pub(crate) law: Color32,
    /// The trigger's level and moment, and thresholds.
    pub(crate) mark: Color32,
    pub(crate) cursor: Color32,
    pub(crate) stuck: Color32,
    pub(crate) sliding: Color32,
}

// Blue and orange after Okabe and Ito (2008), which people with any colour vision tell apart.
const DARK: Palette = Palette {
    rest: Color32::from_rgb(0x45, 0x50, 0x5c),
    live: Color32::from_rgb(0x1c, 0x7a, 0x46),
    caution: Color32::from_rgb(0x92, 0x5f, 0x00),
    halt: Color32::from_rgb(0xc6, 0x28, 0x28),
    on_fill: Color32::WHITE,
    error_text: Color32::from_rgb(0xff, 0x8a, 0x80),
    caution_text: Color32::from_rgb(0xff, 0xc1, 0x5e),
    device: Color32::from_rgb(0x56, 0xb4, 0xe9),
    block: Color32::from_rgb(0xe6, 0x9f, 0x00),
    law: Color32::from_rgb(0xcc, 0x79, 0xa7),
    mark: Color32::from_rgb(0xa8, 0xb2, 0xbd),
    cursor: Color32::from_rgb(0xf0, 0xe4, 0x42),
    stuck: Color32::from_rgb(0x6b, 0x75, 0x80),
    sliding: Color32::from_rgb(0x2f, 0xb3, 0x86),
};

const LIGHT: Palette = Palette {
    rest: Color32::from_rgb(0x5a, 0x65, 0x70),
    live: Color32::from_rgb(0x1b, 0x72, 0x41),
    caution: Color32::from_rgb(0x8a, 0x59, 0x00),
    halt: Color32::from_rgb(0xc6, 0x28, 0x28),
    on_fill: Color32::WHITE,
    error_text: Color32::from_rgb(0xb0, 0x1c, 0x1c),
    caution_text: Color32::from_rgb(0x8a, 0x59, 0x00),
    device: Color32::from_rgb(0x00, 0x72, 0xb2),
    block: Color32::from_rgb(0xb8, 0x4a, 0x00),
    law: Color32::from_rgb(0x9c, 0x3f, 0x74),
    mark: Color32::from_rgb(0x5a, 0x65, 0x70),
    cursor: Color32::from_rgb(0x6a, 0x3d, 0x9a),
    stuck: Color32::from_rgb(0x9a, 0xa3, 0xac),
    sliding: Color32::from_rgb(0x00, 0x7d, 0x5b),
};

impl Palette {
    /// Colours of further lines of a plot, where those of their signals are taken.
    pub(crate) const OTHER_LINES: [fn(&Self) -> Color32; 6] = [
        |palette| palette.device,
        |palette| palette.block,
        |palette| palette.sliding,
        |palette| palette.law,
        |palette| palette.cursor,
        |palette| palette.error_text,
    ];

    /// The palette of the theme that `ui` is drawn in.
    pub(crate) fn of(ui: &Ui) -> &'static Self {
        if ui.visuals().dark_mode { &DARK } else { &LIGHT }
    }

    /// The palette for a white page.
    pub(crate) fn for_paper() -> &'static Self {
        &LIGHT
    }

    pub(crate) fn state(&self, state: RigState) -> Color32 {
        match state {
            RigState::Disconnected | RigState::Idle => self.rest,
            RigState::Engaged => self.live,
            RigState::Engaging | RigState::Releasing => self.caution,
            RigState::Stopped | RigState::Faulted => self.halt,
        }
    }
}

/// Size of the smallest text, points: it is read at arm's length.
pub(crate) const SMALLEST_TEXT: f32 = 13.0;

/// Opacity of what is not of now.
pub(crate) const STALE_OPACITY: f32 = 0.6;

/// How strong the line of a fit is: the samples below it are seen where both agree.
pub(crate) const FIT_OPACITY: f32 = 0.9;

/// The colour behind everything: the window is cleared to it. Clearing is a tenth of the cost of painting the same
/// pixels where there is no graphics card, so the panels have no fill of their own.
#[must_use]
pub fn ground(visuals: &Visuals) -> Color32 {
    let theme = if visuals.dark_mode {
        Visuals::dark()
    } else {
        Visuals::light()
    };
    theme.panel_fill
}

/// Draws hard edges instead of soft ones, which halves the work of a processor that draws by itself: an edge of a
/// line is then a pair of triangles, and not six.
pub fn draw_in_software(ctx: &egui::Context) {
    ctx.tessellation_options_mut(|options| options.feathering = false);
}

/// Sets the sizes and distances of the panel in both themes.
pub fn install(ctx: &egui::Context) {
    ctx.all_styles_mut(|style| {
        style.spacing.item_spacing = egui::vec2(8.0, 4.0);
        style.spacing.interact_size.y = 22.0;
        let body = FontId::new(14.0, FontFamily::Proportional);
        style.text_styles.insert(TextStyle::Body, body.clone());
        style.text_styles.insert(TextStyle::Button, body);
        let small = FontId::new(SMALLEST_TEXT, FontFamily::Proportional);
        style.text_styles.insert(TextStyle::Small, small);
        style.visuals.panel_fill = Color32::TRANSPARENT;
        // The defaults are too faint to be read at arm's length.
        style.visuals.weak_text_alpha = 0.8;
        if style.visuals.dark_mode {
            style.visuals.widgets.noninteractive.fg_stroke.color = Color32::from_gray(175);
        }
        // A pointer on its way to a slider must not select a number.
        style.interaction.selectable_labels = false;
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance after WCAG 2.
    fn luminance(color: Color32) -> f32 {
        let [r, g, b, _] = egui::Rgba::from(color).to_array();
        0.2126 * r + 0.7152 * g + 0.0722 * b
    }

    /// Of one colour on another, after WCAG 2.
    fn contrast(text: Color32, ground: Color32) -> f32 {
        let [text, ground] = [text, ground].map(luminance);
        (text.max(ground) + 0.05) / (text.min(ground) + 0.05)
    }

    /// What may be pressed and what is of now; what is dimmed is neither.
    #[test]
    fn every_text_can_be_read_in_both_themes() {
        let ctx = egui::Context::default();
        install(&ctx);
        for (palette, theme) in [(&DARK, egui::Theme::Dark), (&LIGHT, egui::Theme::Light)] {
            let visuals = ctx.style_of(theme).visuals.clone();
            let plain = [
                visuals.text_color(),
                visuals.weak_text_color(),
                visuals.strong_text_color(),
            ];
            let messages = [palette.error_text, palette.caution_text];
            let lines = [
                palette.device,
                palette.block,
                palette.law,
                palette.law.gamma_multiply(FIT_OPACITY),
                palette.mark,
                palette.cursor,
                palette.sliding,
            ];
            let grounds = [ground(&visuals), visuals.window_fill, visuals.text_edit_bg_color()];
            let mut pairs = Vec::new();
            for text in plain.into_iter().chain(messages).chain(lines) {
                pairs.extend(grounds.map(|ground| (text, ground)));
            }
            let fills = [palette.rest, palette.live, palette.caution, palette.halt];
            pairs.extend(fills.map(|fill| (palette.on_fill, fill)));
            let widgets = &visuals.widgets;
            let buttons = [&widgets.inactive, &widgets.hovered, &widgets.active, &widgets.open];
            pairs.extend(buttons.map(|button| (button.text_color(), button.weak_bg_fill)));
            pairs.push((visuals.selection.stroke.color, visuals.selection.bg_fill));
            for (text, under) in pairs {
                // A weak text is transparent.
                let contrast = contrast(under.blend(text), under);
                assert!(contrast >= 4.5, "{theme:?}: {text:?} on {under:?}: {contrast} to 1");
            }
        }
    }
}
