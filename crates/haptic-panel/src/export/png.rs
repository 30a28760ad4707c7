//! A part of the window's pixels, as a PNG.

use egui::{ColorImage, Pos2, Rect};

/// A part of the window's pixels as a PNG; the whole window if the part lies outside of it.
///
/// # Errors
/// The message of the encoder.
pub fn png(pixels: &ColorImage, part: Rect, pixels_per_point: f32) -> Result<Vec<u8>, String> {
    let whole = Rect::from_min_size(Pos2::ZERO, vec2_of(pixels.size));
    let seen = whole.intersect(part * pixels_per_point);
    let seen = if seen.is_positive() { seen } else { whole };
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "within the picture's size"
    )]
    let [left, top, right, bottom] =
        [seen.left(), seen.top(), seen.right(), seen.bottom()].map(|edge| edge.round() as usize);
    let rows = pixels.pixels.chunks(pixels.size[0].max(1)).skip(top).take(bottom - top);
    let bytes: Vec<u8> = rows
        .flat_map(|row| {
            row[left..right]
                .iter()
                .flat_map(|pixel| [pixel.r(), pixel.g(), pixel.b()])
        })
        .collect();
    let [width, height] = [right - left, bottom - top].map(|side| u32::try_from(side).unwrap_or(u32::MAX));
    let mut content = Vec::new();
    let mut encoder = png::Encoder::new(&mut content, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let failed = |error: png::EncodingError| format!("cannot encode the picture: {error}");
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(&bytes).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(content)
}

fn vec2_of([width, height]: [usize; 2]) -> egui::Vec2 {
    #[expect(
        clippy::cast_precision_loss,
        reason = "a window has fewer pixels than an f32 has digits"
    )]
    let size = egui::vec2(width as f32, height as f32);
    size
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::Color32;

    #[test]
    fn the_pixels_of_the_plots_are_cut_out() {
        let pixels = (0..50u8).map(Color32::from_gray).collect();
        let image = ColorImage::new([10, 5], pixels);
        let part = Rect::from_min_max(Pos2::new(1.0, 1.0), Pos2::new(4.0, 2.0));
        let content = png(&image, part, 2.0).expect("encoded");
        let mut reader = png::Decoder::new(std::io::Cursor::new(content))
            .read_info()
            .expect("a PNG");
        let mut decoded = vec![0; reader.output_buffer_size().expect("a size")];
        reader.next_frame(&mut decoded).expect("a frame");
        assert_eq!((reader.info().width, reader.info().height), (6, 2));
        assert_eq!(decoded[0..6], [22, 22, 22, 23, 23, 23]);
        assert!(png(&image, Rect::NOTHING, 1.0).is_ok());
    }
}
