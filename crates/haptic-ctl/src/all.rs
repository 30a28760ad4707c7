//! `--all status`, `--all stop` and `--all doctor`: every rig of this machine at once. None waits for another.

use crate::command_line::Command;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::{doctor, hint, output, stop};
use haptic_ipc::socket_path::{self, Environment, NamedSocket};
use haptic_ipc::{Request, StateReply, Status};
use serde::Serialize;
use serde_json::{Value, json};
use std::path::Path;
use std::time::Duration;

/// Time after which a rig counts as not answering.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(2);

/// Time for what a stop tells besides: nobody waits for it.
const SOON: Duration = Duration::from_millis(300);

/// What a rig has answered.
struct RigAnswer {
    socket: NamedSocket,
    /// Cells of its row, and its JSON.
    answer: Result<(Vec<String>, Value), Failure>,
}

/// Asks every rig, and that of a socket that is named besides; the exit code is that of the first that fails.
pub(crate) async fn run(command: &Command, named: Option<&Path>, json: bool) -> Result<(), Failure> {
    match command {
        Command::Doctor => doctor::run_all(rigs(false, named)?, json).await,
        Command::Stop => ask_all(true, named, json).await,
        Command::Status => ask_all(false, named, json).await,
        _ => {
            let message = "--all goes with `status`, `stop` and `doctor` alone: everything else is meant for one rig, \
                           named by --rig or --socket";
            Err(Failure::Usage(message.to_owned()))
        }
    }
}

/// Which of some rigs are engaged, with device and socket, as far as they answer soon.
pub(crate) async fn engaged(sockets: Vec<NamedSocket>) -> Vec<String> {
    let asked: Vec<_> = sockets
        .into_iter()
        .map(|socket| tokio::spawn(async move { (status_within(&socket.path, SOON).await, socket) }))
        .collect();
    let mut engaged = Vec::new();
    for answered in asked {
        if let Ok((Ok(status), NamedSocket { name, path })) = answered.await
            && status.state.is_live()
        {
            engaged.push(format!("{name} ({}, {})", status.device.description, path.display()));
        }
    }
    engaged
}

/// Stops every rig, or asks for the status of each, and of that of a socket that is named besides.
pub(crate) async fn ask_all(is_stop: bool, named: Option<&Path>, json: bool) -> Result<(), Failure> {
    let sockets = rigs(is_stop, named)?;
    let ask = move |socket: NamedSocket| {
        tokio::spawn(async move {
            let answer = if is_stop {
                let prefix = (!json).then(|| format!("{}: ", socket.name));
                match stop::ask(Some(&socket.path), prefix.as_deref()).await {
                    Ok(reply) => {
                        let status = status_soon(&socket.path).await;
                        as_json(&reply).map(|json| (stop_row(&reply, status, &socket.path), json))
                    }
                    Err(failure) => Err(failure),
                }
            } else {
                status_within(&socket.path, ANSWER_TIMEOUT)
                    .await
                    .and_then(|status| Ok((status_row(&status), as_json(&status)?)))
            };
            RigAnswer { socket, answer }
        })
    };
    // All at once, and their answers in the order of the sockets.
    let asked: Vec<_> = sockets.into_iter().map(ask).collect();
    let mut answers = Vec::new();
    for answered in asked {
        answers.push(answered.await.map_err(std::io::Error::other)?);
    }
    let key = if is_stop { "stop" } else { "status" };
    if json {
        output::json(&answers.iter().map(|answered| answered.as_json(key)).collect::<Vec<_>>())?;
    } else {
        output::line(&output::table(&answers.iter().map(RigAnswer::row).collect::<Vec<_>>()))?;
    }
    let failed = answers.iter().find_map(|answered| answered.answer.as_ref().err());
    failed.map_or(Ok(()), |failure| Err(Failure::Silent(failure.exit_code())))
}

/// Every rig, and that of a socket that is named besides. Where none is to be stopped, also those that are configured and
/// do not run.
fn rigs(is_stop: bool, named: Option<&Path>) -> Result<Vec<NamedSocket>, Failure> {
    let mut sockets = Environment::of_process().all(named);
    // One that does not run pulls nobody.
    if !is_stop {
        sockets.append(&mut socket_path::configured_besides(&sockets));
    }
    if sockets.is_empty() {
        let message = "there is no socket of a rig on this machine; start one with `hapticd --demo`, or name its \
                       socket with --socket";
        return Err(Failure::NoRig(message.to_owned()));
    }
    Ok(sockets)
}

/// The status of a rig, where it answers soon.
pub(crate) async fn status_soon(socket: &Path) -> Option<Status> {
    status_within(socket, SOON).await.ok()
}

async fn status_within(socket: &Path, time: Duration) -> Result<Status, Failure> {
    let asked = async {
        let mut daemon = Daemon::connect(Some(socket)).await?;
        daemon.ask(Request::Status {}).await
    };
    tokio::time::timeout(time, asked)
        .await
        .unwrap_or(Err(Failure::NoAnswer(time)))
}

fn as_json(answer: &impl Serialize) -> Result<Value, Failure> {
    Ok(serde_json::to_value(answer).map_err(std::io::Error::other)?)
}

fn status_row(status: &Status) -> Vec<String> {
    let mut row = vec![
        status.state.to_string(),
        format!(
            "{:.3} N of {} N",
            status.force_on_hand_n(),
            output::figure(status.device.force_limit_n)
        ),
        status.scene.clone(),
        status.device.description.clone(),
    ];
    let link = status.device.link.as_ref();
    let refusal = || {
        status
            .device
            .engage_refused
            .first()
            .map(|problem| format!("will not engage: {}", problem.what))
    };
    row.extend(status.fault.clone().or_else(|| link?.waiting.clone()).or_else(refusal));
    row
}

fn stop_row(reply: &StateReply, status: Option<Status>, socket: &Path) -> Vec<String> {
    let (done, note) = stop::outcome(reply, status.as_ref());
    let device = status.map_or_else(String::new, |status| status.device.description);
    let mut row = vec![done, socket.display().to_string(), device];
    row.extend(note);
    row
}

impl RigAnswer {
    fn row(&self) -> Vec<String> {
        let cells = match &self.answer {
            Ok((cells, _)) => cells.clone(),
            Err(failure) => vec![failure.to_string()],
        };
        let cells = cells.into_iter().map(|cell| hint::for_rig(&cell, &self.socket));
        std::iter::once(self.socket.name.clone()).chain(cells).collect()
    }

    fn as_json(&self, key: &str) -> Value {
        let (name, path) = (&self.socket.name, &self.socket.path);
        match &self.answer {
            Ok((_, answer)) => json!({ "rig": name, "socket": path, key: answer }),
            Err(failure) => json!({ "rig": name, "socket": path, "error": failure.as_json() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_advises_commands_for_its_own_rig() {
        for (name, advice) in [
            ("left", "`haptic-ctl --rig left reset`"),
            ("/x/control.sock", "`haptic-ctl --socket /x/control.sock reset`"),
        ] {
            let answered = RigAnswer {
                socket: NamedSocket {
                    name: name.to_owned(),
                    path: "/x/control.sock".into(),
                },
                answer: Ok((vec!["`haptic-ctl reset`".to_owned()], Value::Null)),
            };
            assert_eq!(answered.row(), [name, advice]);
        }
    }
}
