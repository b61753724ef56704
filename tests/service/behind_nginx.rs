//! Two processes behind nginx, over one folder of scenes: nothing depends on which one answers.
//!
//! Needs nginx (Debian's `nginx-light` will do); where there is none the test says so and is not run.

use std::collections::BTreeMap;
use std::fs;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::thread;
use std::time::{Duration, Instant};

use retina_tests::spawned::Spawned;
use retina_tests::stream_client::StreamClient;
use serde_json::{Value, json};

use crate::harness::{agent, request, runtime, with};
use crate::stored::{call, id, shifted};

/// A proxy with a folder of its own, which goes with it.
struct Proxy {
    process: Child,
    folder: PathBuf,
    address: String,
}

impl Proxy {
    /// The configuration of `deploy/nginx.conf` with other addresses; `None` where there is no nginx.
    fn start(servers: [&str; 2]) -> Option<Self> {
        let folder = std::env::temp_dir().join(format!("retina-{}-nginx", std::process::id()));
        fs::create_dir_all(&folder).expect("folder");
        let free = TcpListener::bind("127.0.0.1:0").expect("port").local_addr().expect("address").to_string();
        let conf = include_str!("../../deploy/nginx.conf");
        assert!(["127.0.0.1:8080", "127.0.0.1:8081", "127.0.0.1:8082"].iter().all(|known| conf.contains(known)));
        let conf = conf.replace("127.0.0.1:8081", servers[0]).replace("127.0.0.1:8082", servers[1]);
        let conf = conf.replace("127.0.0.1:8080", &free);
        let within = folder.display();
        let paths: String = ["client_body", "proxy", "fastcgi", "uwsgi", "scgi"]
            .map(|name| format!("{name}_temp_path {within}/{name};\n"))
            .concat();
        let whole = format!(
            "daemon off;\nmaster_process off;\npid {within}/pid;\nerror_log stderr error;\nevents {{}}\nhttp {{\naccess_log off;\n{paths}{conf}}}\n"
        );
        let file = folder.join("nginx.conf");
        fs::write(&file, whole).expect("configuration");
        let nginx = |program: &str| Command::new(program).arg("-p").arg(&folder).arg("-c").arg(&file).spawn();
        let process = nginx("nginx").or_else(|_| nginx("/usr/sbin/nginx")).ok()?;
        let proxy = Self { process, folder, address: free };
        let patience = Instant::now() + Duration::from_secs(20);
        while agent().get(proxy.url("/healthz")).call().map(|answer| answer.status().as_u16()).unwrap_or_default()
            != 200
        {
            assert!(Instant::now() < patience, "nginx does not answer");
            thread::sleep(Duration::from_millis(20));
        }
        Some(proxy)
    }

    fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }

    /// Who answered, the status and the body.
    fn predict(&self, request: &Value) -> (String, u16, Value) {
        let post = agent().post(self.url("/v1/predict")).header("content-type", "application/json");
        let mut response = post.send(request.to_string()).expect("answer");
        let by = response.headers()["x-answered-by"].to_str().expect("text").to_owned();
        let text = response.body_mut().read_to_string().expect("body");
        (by, response.status().as_u16(), serde_json::from_str(&text).expect("JSON"))
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

#[test]
fn nothing_depends_on_which_of_two_processes_answers() {
    let scenes = std::env::temp_dir().join(format!("retina-{}-behind", std::process::id()));
    let arguments = ["--threads", "1", "--scene-store", scenes.to_str().expect("UTF-8")];
    let program = Path::new(env!("CARGO_BIN_EXE_serve"));
    let [one, other] = [(); 2].map(|()| Spawned::start(program, &arguments).expect("program"));
    let Some(proxy) = Proxy::start([&one.address, &other.address]) else {
        eprintln!("no nginx: not run");
        return;
    };
    // A scene stored by one is used by both, at once.
    let (status, told) = call("POST", &proxy.url("/v1/scenes"), Some(&shifted(0.0)));
    assert!(matches!(status, 200 | 201), "{told}");
    let mut answered = BTreeMap::<String, usize>::new();
    for level in ["linear", "network", "coarse"] {
        let asked = with(request(level), "/scene", told["id"].clone());
        let mut surfaces = Vec::new();
        for _ in 0..12 {
            let (by, status, answer) = proxy.predict(&asked);
            assert_eq!(status, 200, "{by}: {answer}");
            *answered.entry(by).or_default() += 1;
            surfaces.push(answer["surface"].clone());
        }
        assert!(surfaces.windows(2).all(|pair| pair[0] == pair[1]), "{level}: the bits depend on who answers");
    }
    assert_eq!(answered.len(), 2, "both answer: {answered:?}");
    // Streams pass, with whoever they begin at.
    for _ in 0..4 {
        runtime().block_on(async {
            let address = proxy.address.parse().expect("address");
            let mut client = StreamClient::connect(address).await.expect("handshake");
            client.open(json!({"scene": told["id"], "accuracy": {"level": "linear"}})).await.expect("session");
            client.send(&json!({"pose": {"sequence": 1, "tip_mm": [0, 0, -0.01]}})).await.expect("sent");
            client.receive().await;
        });
    }
    // One is killed: the other answers what it would have.
    one.kill().expect("killed");
    for _ in 0..12 {
        let (by, status, answer) = proxy.predict(&with(request("linear"), "/scene", told["id"].clone()));
        assert_eq!(status, 200, "{by}: {answer}");
    }
    assert_eq!(call("DELETE", &proxy.url(&format!("/v1/scenes/{}", id(&told))), None).0, 204);
    let _ = fs::remove_dir_all(&scenes);
}
