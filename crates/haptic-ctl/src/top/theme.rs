//! Colours and styles.

use haptic_ipc::RigState;
use ratatui::style::{Color, Modifier, Style};

/// The styles of the picture, with or without colours.
#[derive(Clone, Copy)]
pub(super) struct Theme {
    coloured: bool,
}

impl Theme {
    pub(super) const fn new(coloured: bool) -> Self {
        Self { coloured }
    }

    pub(super) fn colour(self, colour: Color) -> Style {
        if self.coloured {
            Style::new().fg(colour)
        } else {
            Style::new()
        }
    }

    pub(super) fn state(self, state: RigState) -> Style {
        let colour = match state {
            RigState::Engaged | RigState::Engaging => Color::Green,
            RigState::Releasing => Color::Yellow,
            RigState::Stopped | RigState::Faulted => Color::Red,
            RigState::Idle | RigState::Disconnected => Color::Gray,
        };
        self.colour(colour).add_modifier(Modifier::REVERSED | Modifier::BOLD)
    }
}
