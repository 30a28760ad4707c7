//! The live tuning panel of hapticd, in a window.

mod window;
mod x11_keys;

use clap::{CommandFactory, Parser};
use haptic_ipc::socket_path::{self, Environment};
use haptic_panel::connection::{Connection, Patience};
use haptic_panel::{App, Files, Page, Settings, Theme, theme};
use std::path::PathBuf;
use std::process::ExitCode;
use window::{Window, is_drawn_in_software, x11_window};

/// Tune hapticd while a hand is on the rig, and plot what the hand feels.
///
/// Escape stops the rig at once, whatever has the focus, and so does Space unless you type in a text
/// field. The panel waits for its daemon, and reconnects by itself.
#[derive(Debug, Parser)]
#[command(version)]
struct Arguments {
    /// Control socket of the daemon. Without it: $HAPTICD_SOCKET, then the first that exists of
    /// $XDG_RUNTIME_DIR/hapticd/control.sock, /run/user/UID/hapticd/control.sock,
    /// ~/.local/state/hapticd/control.sock and /run/hapticd/control.sock.
    #[arg(long, value_name = "PATH")]
    socket: Option<PathBuf>,

    /// Rig of this name: of the service hapticd@NAME, or of hapticd itself
    #[arg(long, value_name = "NAME", value_parser = socket_path::rig_name, conflicts_with = "socket")]
    rig: Option<String>,

    /// Recording to open; this needs no daemon.
    #[arg(long, value_name = "FILE")]
    open: Option<PathBuf>,

    /// Study to continue, made by this panel or by `haptic-ctl study new`.
    #[arg(long, value_name = "DIR")]
    study: Option<PathBuf>,

    /// Page to begin with.
    #[arg(long, value_name = "PAGE", value_enum, default_value_t = Page::default())]
    page: Page,

    /// Print the manual page, for a package.
    #[arg(long, hide = true)]
    manual_page: bool,

    /// Colours of the panel [default: those remembered, else those of the desktop]
    #[arg(long, value_name = "THEME", value_enum)]
    theme: Option<Theme>,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    if arguments.manual_page {
        let page = clap_mangen::Man::new(Arguments::command());
        return page
            .render(&mut std::io::stdout())
            .map_or(ExitCode::FAILURE, |()| ExitCode::SUCCESS);
    }
    let file = Settings::file();
    let settings = file.as_deref().map_or_else(|| Ok(Settings::default()), Settings::read);
    let known = settings.clone().unwrap_or_default();
    let size = known
        .window_size
        .filter(|size| size.iter().all(|side| side.is_finite()));
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_app_id("haptic-gui")
            .with_inner_size(size.unwrap_or([1280.0, 760.0]))
            .with_min_inner_size([1024.0, 640.0]),
        // There is no gradient that would show bands.
        dithering: false,
        ..Default::default()
    };
    let result = eframe::run_native(
        "Haptic panel",
        options,
        Box::new(move |creation| {
            let ctx = creation.egui_ctx.clone();
            ctx.set_theme(arguments.theme.or(known.theme).unwrap_or(Theme::System));
            theme::install(&ctx);
            let in_software = is_drawn_in_software(creation);
            let is_named = arguments.rig.is_some() || arguments.socket.is_some();
            let (rig, socket) = (arguments.rig, arguments.socket);
            let locate = move || match &rig {
                Some(name) => Environment::of_process().for_rig(name),
                None => socket_path::for_client(socket.as_deref()),
            };
            let repaint = {
                let ctx = ctx.clone();
                move |wait| ctx.request_repaint_after(wait)
            };
            let files = Files::new(repaint.clone());
            let named = is_named.then(&locate);
            let mut app = App::new(Connection::start(locate, Patience::default(), repaint)?, files);
            app.name_socket(named);
            if let Some(window) = x11_window(creation)
                && let Err(error) = x11_keys::watch(None, window, app.space_is_typed(), app.stopper())
            {
                eprintln!("haptic-gui: a stop by key waits for the frame that is being drawn: {error}");
            }
            if in_software {
                theme::draw_in_software(&ctx);
                app.draw_in_software();
            }
            app.turn_to(arguments.page);
            if let Some(file) = file {
                app.remember(file, settings);
            }
            if let Some(folder) = arguments.study {
                app.open_study(folder);
            }
            if let Some(path) = arguments.open {
                app.files().open(path);
            }
            Ok(Box::new(Window { app, ctx }))
        }),
    );
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("haptic-gui: cannot open a window: {error}");
            ExitCode::FAILURE
        }
    }
}
