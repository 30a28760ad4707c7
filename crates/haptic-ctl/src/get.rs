//! `get`: a scene's parameters, or the value of one.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::scene::reference;
use crate::{complete, output, units};
use clap_complete::engine::ArgValueCompleter;
use haptic_core::parameters::TABLE;
use haptic_core::{Directional, ParameterKey, SceneError};
use haptic_ipc::{ClientError, ErrorCode, Request, SceneReply, WireError};
use serde_json::json;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Scene: NAME, @REVISION or FILE.toml [default: active]; or a parameter, as in Fs+
    #[arg(add = ArgValueCompleter::new(complete::scenes))]
    scene: Option<String>,
}

impl Arguments {
    pub(crate) fn request(&self) -> Result<Request, Failure> {
        let scene = match self.parameter() {
            Some(_) => None,
            None => reference::read_optional(self.scene.as_ref())?,
        };
        Ok(Request::Get { scene })
    }

    fn parameter(&self) -> Option<ParameterKey> {
        self.scene.as_ref()?.parse().ok()
    }
}

pub(crate) async fn run(
    daemon: &mut Daemon,
    arguments: &Arguments,
    request: Request,
    json: bool,
) -> Result<(), Failure> {
    let reply: SceneReply = match reference::ask(daemon, request).await {
        Err(failure) => return Err(with_parameter_meant(arguments, failure)),
        answered => answered?,
    };
    if let Some(key) = arguments.parameter() {
        return show_one(&reply, key, json);
    }
    if json {
        return output::json(&reply);
    }
    let rows: Vec<Vec<String>> = TABLE
        .iter()
        .filter_map(|row| {
            let value = output::directional(*reply.params.get(row.name)?);
            Some(vec![
                row.name.to_owned(),
                row.symbol.to_owned(),
                value,
                units::shown(row.unit).to_owned(),
            ])
        })
        .collect();
    let which = match &arguments.scene {
        None => format!("revision {}", reply.revision),
        Some(scene) => scene.clone(),
    };
    output::line(&format!(
        "{} ({which}, {})\n{}",
        reply.scene.name,
        reply.scene.friction.law(),
        output::table(&rows)
    ))
}

/// The refusal of a name that is not a scene's, with the parameter that it was probably meant to be.
fn with_parameter_meant(arguments: &Arguments, failure: Failure) -> Failure {
    let Some(name) = &arguments.scene else { return failure };
    match (failure, name.parse::<ParameterKey>()) {
        (
            Failure::Client(ClientError::Refused(mut error)),
            Err(SceneError::UnknownParameter {
                nearest: Some(meant), ..
            }),
        ) if error.code == ErrorCode::NoSuchScene => {
            error.message = format!("there is no parameter and no scene `{name}`, did you mean `{meant}`?");
            Failure::Client(ClientError::Refused(error))
        }
        (failure, _) => failure,
    }
}

fn show_one(reply: &SceneReply, key: ParameterKey, json: bool) -> Result<(), Failure> {
    let info = key.parameter.info();
    let Some(value) = reply.params.get(info.name) else {
        let has: Vec<&str> = reply.params.keys().map(String::as_str).collect();
        let message = format!("the scene has no {}; it has {}", info.name, has.join(", "));
        return Err(ClientError::Refused(WireError::new(ErrorCode::NotApplicable, message).about(info.name)).into());
    };
    let value = key
        .direction
        .map_or(*value, |direction| Directional::both(value.get(direction)));
    if json {
        return output::json(&json!({ "param": key.to_string(), "value": value, "unit": info.unit }));
    }
    let text = format!("{} {}", output::directional(value), units::shown(info.unit));
    output::line(text.trim_end())
}
