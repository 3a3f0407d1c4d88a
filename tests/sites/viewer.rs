//! The viewer in a browser: drawn like `render`, driven by keys and clicks, silent. Needs Chromium; says “skipped” without.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "a test that cannot go on")]

use crate::support::{Built, Paint, grey, options, sunny_room, v};
use clerestory::bake::{self, bake};
use clerestory::panorama::{Exposure, Picture};
use clerestory::render::{Relit, render};
use clerestory::site::Site;
use clerestory::study::flip_ldr;
use clerestory::viewer::{Extras, write_viewer};
use glam::Vec3;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket, client};

/// A browser without a window, and what its page logs.
struct Browser {
    process: Child,
    socket: WebSocket<TcpStream>,
    next: u64,
    session: Option<String>,
    logged: Vec<String>,
}

impl Browser {
    /// Starts Chromium with its software renderer; `None` where there is none.
    fn start(folder: &Path) -> Option<Self> {
        let flags = [
            "--headless=new",
            "--no-sandbox",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--disable-dev-shm-usage",
            "--hide-scrollbars",
            "--remote-debugging-port=0",
        ];
        let found = ["chromium", "chromium-browser", "google-chrome"].into_iter().find_map(|name| {
            let mut command = Command::new(name);
            command.args(flags).arg(format!("--user-data-dir={}", folder.join("browser").display()));
            command.arg("about:blank").stdout(Stdio::null()).stderr(Stdio::piped()).spawn().ok()
        });
        let mut process = found?;
        let lines = BufReader::new(process.stderr.take().unwrap()).lines();
        let address =
            lines.map_while(Result::ok).find_map(|l| Some(l.split_once("DevTools listening on ")?.1.to_owned()));
        let address = address.unwrap();
        let host = address.trim_start_matches("ws://").split('/').next().unwrap().to_owned();
        let stream = TcpStream::connect(host).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let (socket, _) = client(&address, stream).unwrap();
        Some(Self { process, socket, next: 0, session: None, logged: Vec::new() })
    }

    /// Calls a method of the browser's protocol and waits for its answer.
    fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.next += 1;
        let mut message = json!({"id": self.next, "method": method, "params": parameters});
        if let Some(session) = &self.session {
            message["sessionId"] = session.as_str().into();
        }
        self.socket.send(Message::text(message.to_string())).unwrap();
        loop {
            let Message::Text(text) = self.socket.read().unwrap() else { continue };
            let answer: Value = serde_json::from_str(&text).unwrap();
            let event = answer["method"].as_str().unwrap_or_default();
            let page = answer["params"]["request"]["url"]
                .as_str()
                .is_some_and(|u| u.starts_with("file:") || u.starts_with("blob:"));
            if ["Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded"].contains(&event)
                || event == "Network.requestWillBeSent" && !page
            {
                self.logged.push(text.to_string());
            }
            if answer["id"] == self.next {
                assert!(answer["error"].is_null(), "{method}: {answer}");
                return answer["result"].clone();
            }
        }
    }

    /// Opens a page at a size in pixels.
    fn open(&mut self, page: &str, [width, height]: [u32; 2]) {
        self.session = None;
        let target = self.call("Target.createTarget", json!({"url": "about:blank"}));
        let attached = self.call("Target.attachToTarget", json!({"targetId": target["targetId"], "flatten": true}));
        self.session = attached["sessionId"].as_str().map(str::to_owned);
        for domain in ["Page.enable", "Runtime.enable", "Log.enable", "Network.enable"] {
            self.call(domain, json!({}));
        }
        let size = json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": false});
        self.call("Emulation.setDeviceMetricsOverride", size);
        self.call("Page.navigate", json!({"url": page}));
        self.until("!!(window.viewer && window.viewer.ready)");
    }

    fn ask(&mut self, expression: &str) -> Value {
        let asked = json!({"expression": expression, "returnByValue": true, "awaitPromise": true});
        self.call("Runtime.evaluate", asked)["result"]["value"].clone()
    }

    /// Waits until something is true on the page.
    fn until(&mut self, expression: &str) {
        let start = Instant::now();
        while self.ask(expression) != true {
            let says = self.ask("document.body && document.body.innerText");
            assert!(start.elapsed() < Duration::from_secs(60), "{expression}: {says}");
            std::thread::sleep(Duration::from_millis(30));
        }
    }

    fn key(&mut self, key: &str) {
        for kind in ["keyDown", "keyUp"] {
            let text = if key.len() == 1 && kind == "keyDown" { key } else { "" };
            self.call("Input.dispatchKeyEvent", json!({"type": kind, "key": key, "text": text}));
        }
    }

    fn click(&mut self, x: f64, y: f64) {
        for kind in ["mousePressed", "mouseReleased"] {
            self.call(
                "Input.dispatchMouseEvent",
                json!({"type": kind, "x": x, "y": y, "button": "left", "clickCount": 1}),
            );
        }
    }

    /// The page as linear screen values.
    fn picture(&mut self) -> Picture {
        use base64::Engine;
        let shot = self.call("Page.captureScreenshot", json!({"format": "png"}));
        let png = base64::engine::general_purpose::STANDARD.decode(shot["data"].as_str().unwrap()).unwrap();
        let image = image::load_from_memory(&png).unwrap().into_rgb8();
        let linear =
            |p: &image::Rgb<u8>| Vec3::from(p.0.map(|c| clerestory::panorama::srgb_to_linear(f32::from(c) / 255.0)));
        let (width, height) = (image.width() as usize, image.height() as usize);
        Picture { width, height, pixels: image.pixels().map(linear).collect() }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // nobody is left to tell if it is gone already
        let _ = self.process.kill().and_then(|()| self.process.wait());
    }
}

/// A room with a checkered block, a sun, and an end that no probe sees.
fn room() -> Built {
    // painted on its two large faces: on the narrow ones squares would be finer than pixels
    let mut plan = sunny_room([0, 0, 0, 0, 1, 1], 128, "[9, 8.6, 8]")
        .view(v(0.4, 0.3, 1.2), v(3.5, 2.5, 1.0), 256)
        .view(v(3.7, 2.6, 1.7), v(2.0, 1.0, 0.4), 256);
    plan.paints.push(Paint { checker: true, ..grey(0.8) });
    plan.build().trace(&plan, 64)
}

/// Every view looks as `render` shows it; keys, clicks and the tape measure work; nothing is logged or fetched.
#[test]
fn the_page_shows_what_render_shows_and_obeys_keys_and_clicks() {
    let built = room();
    let folder = built.folder.path();
    let Some(mut browser) = Browser::start(folder) else {
        println!("skipped: there is no Chromium");
        return;
    };
    let site = Site::load(folder).unwrap();
    let settings =
        bake::BakeSettings { vertices: 60_000, error: 0.05, sun_apart: true, ..bake::BakeSettings::default() };
    let made = bake(&site, &built.scene, &options(24), &settings, &|_| ()).unwrap();
    let page = folder.join("viewer.html");
    let extras = Extras { command: "</script> & test".to_owned(), ..Extras::default() };
    write_viewer(&page, &site, &built.scene, &made.baked, &extras).unwrap();
    let url = format!("file://{}", page.display());
    // by the bake's own volume: another one has other noise
    let volumes = made.setup.volumes(&built.scene);
    let light = &made.setup.lights[0].1;
    let relit = Relit { scene: &built.scene, light, volume: volumes[0].as_ref(), volume_only: false };
    for view in &site.views {
        let frame = render(&built.scene, &relit, &view.camera, 4, &|_, _| ());
        browser.open(&format!("{url}#bare&view={}", view.name), [256, 256]);
        browser.until("!viewer.state.dirty && viewer.state.rough === 0");
        let shown = browser.picture();
        let exposure = Exposure::of(&frame.radiance);
        let truth: Vec<Vec3> = frame.radiance.pixels.iter().map(|p| exposure.bend(*p)).collect();
        assert_eq!((shown.width, shown.height), (256, 256));
        let map = flip_ldr(&shown.pixels, &truth, 256, 256);
        let flip = map.iter().sum::<f32>() / map.len() as f32;
        println!("{}: FLIP {flip:.4}", view.name);
        // black beside white all over: each filters a texture in its own way
        assert!(flip < 0.05, "{}: FLIP {flip}", view.name);
    }
    browser.open(&url, [390, 700]);
    assert_eq!(browser.ask("document.documentElement.scrollWidth <= 390"), true, "fits a telephone");
    assert_eq!(browser.ask("document.getElementById('source').textContent.includes('</script> & test')"), true);
    browser.key("2");
    assert_eq!(browser.ask("document.getElementById('view').value"), "v1");
    browser.key("l");
    assert_eq!(browser.ask("viewer.state.layer"), 1);
    browser.key("+");
    assert_eq!(browser.ask("viewer.state.stops"), 0.5);
    let before = browser.ask("viewer.state.eye.join()");
    browser.call("Input.dispatchKeyEvent", json!({"type": "keyDown", "key": "ArrowUp"}));
    browser.until(&format!("viewer.state.eye.join() !== {before}"));
    browser.call("Input.dispatchKeyEvent", json!({"type": "keyUp", "key": "ArrowUp"}));
    assert_eq!(browser.ask("viewer.state.view"), Value::Null, "free of the view");
    // the tape: along the block's top edge, 2 m, in a view whose picture fills the canvas
    browser.open(&url, [256, 256]);
    browser.key("2");
    browser.key("t");
    let camera = site.views[1].camera;
    for end in [v(2.15, 0.6, 1.4), v(2.15, 2.4, 1.4)] {
        let at = camera.project(end).unwrap();
        browser.click(at.x, at.y);
    }
    let told = browser.ask("document.getElementById('words').textContent");
    let metres: f64 = told.as_str().unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((metres - 1.8).abs() < 0.04, "{told}");
    // what the address keeps
    browser.until("location.hash.includes('view=v1')");
    assert!(browser.logged.is_empty(), "{:?}", browser.logged);
}
