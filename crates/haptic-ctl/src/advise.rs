//! `advise`: what the scene in force will do to the rig.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use haptic_ipc::{AdviceReply, Request};

pub(crate) async fn run(daemon: &mut Daemon, json: bool) -> Result<(), Failure> {
    let reply: AdviceReply = daemon.ask(Request::Advise {}).await?;
    if json {
        return output::json(&reply);
    }
    let mut rows = vec![
        ["", "check", "value", "bound", "margin", "to mend it"]
            .map(str::to_owned)
            .to_vec(),
    ];
    let mut remarks = Vec::new();
    for advice in reply.advice {
        let Some(finding) = advice.finding else {
            remarks.push(format!("note: {}", advice.message));
            continue;
        };
        let number = |value: Option<f64>| value.map_or_else(|| "inf".to_owned(), |value| format!("{value:.4}"));
        let with_unit = |value| format!("{} {}", number(value), finding.unit);
        rows.push(vec![
            if finding.passes { "ok" } else { "broken" }.to_owned(),
            finding.check.clone(),
            with_unit(finding.value),
            with_unit(finding.bound),
            number(finding.margin),
            finding
                .mending
                .map_or_else(String::new, |value| format!("{} = {value:.4}", advice.param)),
        ]);
        if !finding.passes {
            remarks.push(format!("{}: {}", finding.check, advice.message));
        }
    }
    output::line(&output::table(&rows))?;
    for remark in remarks {
        output::line(&remark)?;
    }
    Ok(())
}
