#![no_main]

clerestory_fuzz::target!("e57");
