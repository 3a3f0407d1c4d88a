#![no_main]

clerestory_fuzz::target!("obj");
