//! What is written is large enough to be read, and none of it is cut at an edge.

use crate::bench::{Panel, at_page, panel, press};
use crate::layout::pages;
use egui::epaint::{ClippedShape, TextShape};
use egui::{Rect, Shape, vec2};
use haptic_panel::Page;

/// The usual window, points.
const USUAL: egui::Vec2 = vec2(1280.0, 760.0);

/// Size of the smallest text, points.
const SMALLEST: f32 = 13.0;

/// Every text that is drawn, with the area outside which nothing of it is seen.
pub(crate) fn texts(panel: &Panel) -> Vec<(Rect, &TextShape)> {
    fn within<'a>(clip: Rect, shape: &'a Shape, texts: &mut Vec<(Rect, &'a TextShape)>) {
        match shape {
            Shape::Text(text) => texts.push((clip, text)),
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| within(clip, shape, texts)),
            _ => {}
        }
    }
    let mut texts = Vec::new();
    for ClippedShape { clip_rect, shape, .. } in &panel.output().shapes {
        within(*clip_rect, shape, &mut texts);
    }
    texts
}

/// Pages in use, empty ones, and the help, in the usual window.
fn usual() -> Vec<(String, Panel)> {
    let mut all: Vec<_> = pages().map(|(name, page)| (name.to_owned(), page())).into();
    for page in Page::ALL {
        all.push((format!("{page:?}, empty"), at_page(panel(), *page)));
    }
    let mut help = panel();
    press(&mut help, "help");
    all.push(("Help".to_owned(), help));
    for (_, panel) in &mut all {
        panel.set_size(USUAL);
        panel.run();
        panel.run();
    }
    all
}

#[test]
fn no_text_is_too_small_or_cut_at_an_edge() {
    let mut bad = Vec::new();
    for (name, panel) in usual() {
        let window = panel.ctx.content_rect();
        let texts = texts(&panel);
        assert!(texts.len() > 8, "{name}");
        for (clip, text) in texts {
            let (words, rect) = (text.galley.text(), text.visual_bounding_rect());
            let mut sections = text.galley.job.sections.iter();
            if sections.any(|section| section.format.font_id.size < SMALLEST) {
                bad.push(format!("{name}: {words} is too small"));
            }
            // What is scrolled out of sight is not cut.
            let is_seen = clip.intersects(rect.shrink(0.5));
            let area = clip.intersect(window).expand(1.0);
            let is_cut = rect.left() < area.left() || rect.right() > area.right();
            if is_seen && (is_cut || text.galley.elided) {
                bad.push(format!("{name}: {words} is cut: {rect} in {area}"));
            }
        }
    }
    assert!(bad.is_empty(), "{}", bad.join("\n"));
}
