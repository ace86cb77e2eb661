"""`rapi bench`: check a bench, take fringe records, start a simulated one, bridge a laser."""

import threading
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Parameter, validators

from fitting.commands.shared._plugins import Plugins

Port = Annotated[int, Parameter(validator=validators.Number(gte=0, lte=65535))]
Metres = Annotated[float, Parameter(validator=validators.Number(gte=0, lte=1000))]
Json = Annotated[bool, Parameter(negative="")]

app = App(name="bench", help="A bench of instruments, real or simulated.", help_format="plaintext")
app.command(
    "fitting.commands.bench.range:bench_range",
    name="range",
    help="Take fringe records of a target, for `rapi range`.",
)


@app.command
def check(bench: Path, /, *, plugin: Plugins = (), json: Json = False) -> int:
    """Connect to every instrument of BENCH, match identities, limits and interlocks; play nothing.

    Outputs are switched off, load and clamp set and read back.

    Parameters
    ----------
    bench
        `bench.toml`.
    plugin
        A Python file with drivers that BENCH names by their `kind`; its code is run. May be given
        several times.
    json
        Print one JSON object on standard output.
    """
    from fitting.commands.shared._out import console, print_json
    from fitting.commands.shared._plugins import load_plugins, plugin_classes
    from hardware import AbstractDriver, open_bench

    drivers = plugin_classes(load_plugins(plugin), AbstractDriver)
    with open_bench(bench, drivers=drivers) as opened:
        found = opened.provenance()
        limits = opened.channel.limits
    del found["history"], found["file"]
    found["limits"] = (
        f"{limits.low_v:g} to {limits.high_v:g} V, {limits.slew_v_per_s:g} V/s, steps of "
        f"{limits.step_v:g} V, {limits.max_frequency_hz:g} Hz, at the generator"
    )
    if json:
        print_json({"schema": "rapi.bench-check/1", **found})
        return 0
    out = console(json)
    for name, value in found.items():
        out.print(f"{name:22} {value}", markup=False, soft_wrap=True)
    out.print("every instrument is the one it should be; no output is on", markup=False)
    return 0


@app.command
def serve(
    bench: Path,
    /,
    *,
    wires: Literal["hislip", "socket"] = "hislip",
    laser: Literal["ecdl", "dfb", "vcsel"] = "ecdl",
    device: Literal["paper", "unmodelled"] = "paper",
    seed: int = 0,
    target: Metres | None = None,
    velocity: float = 0.0,
) -> int:
    """Start a simulated laboratory on this computer, and write the bench file that reaches it.

    Generator, laser controller and oscilloscope answer on 127.0.0.1 until Ctrl-C.

    Parameters
    ----------
    bench
        The `bench.toml` to write.
    wires
        HiSLIP, or raw TCP sockets.
    laser
        An external-cavity laser with a piezo, or a DFB laser or VCSEL that its current tunes.
    device
        The external-cavity laser of the paper, or one with effects that its model has no term for.
    seed
        Of all noise.
    target
        Distance of a target before a measurement arm, m, for `rapi bench range`.
    velocity
        Of the target from the start of the laboratory on, m/s.
    """
    from fitting.commands.shared._out import console
    from hardware import HislipServer, TcpServer
    from hardware.simulated import (
        ConstantVelocity,
        MeasurementArm,
        SimulatedBench,
        Target,
        WiredLaboratory,
        bench_toml,
        current_tuned_toml,
    )
    from rapi_jax.io import write_atomic

    piezo = laser == "ecdl"
    if device == "unmodelled" and not piezo:
        raise CycloptsError(msg=f"`--device unmodelled` is an external-cavity laser, no {laser}.")
    arm = None
    if target is not None:
        arm = MeasurementArm(Target(target) + ConstantVelocity(velocity))
    if laser == "dfb":
        simulated = SimulatedBench.dfb(measurement=arm)
    elif laser == "vcsel":
        simulated = SimulatedBench.vcsel(measurement=arm)
    else:
        simulated = SimulatedBench.like_paper(unmodelled=device == "unmodelled", measurement=arm)
    laboratory = simulated.laboratory
    lab = WiredLaboratory(laboratory, seed=seed, controller=piezo)
    with lab.served(HislipServer if wires == "hislip" else TcpServer) as at:
        if piezo:
            delay_s = laboratory.interferometer.delay_s
            text = bench_toml(at, delay_s=delay_s, measurement=arm is not None)
        else:
            text = current_tuned_toml(at, laboratory, limits=simulated.limits)
        write_atomic(bench, text)
        out = console(False)
        for name, resource in at.items():
            out.print(f"{name:10} {resource}", markup=False, soft_wrap=True)
        out.print(f"written to {bench}; Ctrl-C ends the laboratory", markup=False, soft_wrap=True)
        threading.Event().wait()
    return 0


@app.command
def bridge(
    serial: str, /, *, library: str = "usbdll.dll", host: str = "127.0.0.1", port: Port = 4880
) -> int:
    """Put the TLB-6700 with SERIAL on the network, from the Windows computer that has it.

    Whoever can reach the port can set the laser: nothing is asked of a client.

    Parameters
    ----------
    serial
        Its serial number, such as SN1012.
    library
        The vendor's library, or its path.
    host
        The address to listen at; by default this computer alone.
    port
        HiSLIP's is 4880.
    """
    from fitting.commands.shared._out import console
    from hardware import Bridge, HislipServer, VendorDllLink

    with (
        VendorDllLink(serial, library=library) as link,
        HislipServer(Bridge(link), port, host=host) as server,
    ):
        line = f"{server.resource}; Ctrl-C ends the bridge"
        console(False).print(line, markup=False, soft_wrap=True)
        threading.Event().wait()
    return 0
