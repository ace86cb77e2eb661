"""`rapi bench`: check a bench, take fringe records, start a simulated one, bridge a laser."""

import contextlib
import threading
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Parameter, validators

from fitting.commands.shared._plugins import Plugins

Port = Annotated[int, Parameter(validator=validators.Number(gte=0, lte=65535))]
Metres = Annotated[float, Parameter(validator=validators.Number(gte=0, lte=1000))]
Json = Annotated[bool, Parameter(negative="")]

app = App(
    name="bench",
    help="A bench of instruments, real or simulated.",
    help_format="plaintext",
    help_epilogue="",
)
app.command(
    "fitting.commands.bench.range:bench_range",
    name="range",
    help="Take fringe records of a target, for `rapi range`.",
)


@app.command
def check(bench: Path, /, *, plugin: Plugins = (), json: Json = False) -> int:
    """Connect to every instrument of BENCH, match identities, limits and interlocks; play nothing.

    An output found on (as after a killed process) is reported with what it played, then parked and
    switched off. Load and clamp are set and read back.

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
    first = ["generator_found_on"] * ("generator_found_on" in found)
    for name, value in ((one, found[one]) for one in dict.fromkeys([*first, *found])):
        out.print(f"{name:22} {value}", markup=False, soft_wrap=True)
    out.print(
        "every instrument was identified as expected; the generator's output is off", markup=False
    )
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

    Generator, laser controller and oscilloscope answer on 127.0.0.1 until Ctrl-C, which ends it
    as is meant: exit code 0.

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
        Seed of all noise.
    target
        Distance of a target in the measurement arm, m, for `rapi bench range`. By default no
        target.
    velocity
        Velocity of the target from the start of the laboratory on, m/s.
    """
    from fitting.commands.shared._out import console
    from fitting.commands.shared.files._measured_output import check_bench_output, sealed
    from hardware import HislipServer, TcpServer, missing_packages
    from hardware.simulated import (
        ConstantVelocity,
        MeasurementArm,
        SimulatedBench,
        Target,
        WiredLaboratory,
        bench_toml,
        current_tuned_toml,
    )
    from rapi_jax.internal import install_extra
    from rapi_jax.io import write_atomic

    check_bench_output(bench)
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
    out = console(False)
    if missing := missing_packages():
        out.print(
            f"note: {', '.join(missing)} not installed here, so `rapi bench check` and `rapi "
            "measure` cannot reach this laboratory from this Python. " + install_extra("lab"),
            markup=False,
            soft_wrap=True,
        )
    with lab.served(HislipServer if wires == "hislip" else TcpServer) as at:
        if piezo:
            delay_s = laboratory.interferometer.delay_s
            text = bench_toml(at, delay_s=delay_s, measurement=arm is not None)
        else:
            text = current_tuned_toml(at, laboratory, limits=simulated.limits)
        write_atomic(bench, sealed(text))
        for name, resource in at.items():
            out.print(f"{name:10} {resource}", markup=False, soft_wrap=True)
        out.print(f"written to {bench}; Ctrl-C ends the laboratory", markup=False, soft_wrap=True)
        with contextlib.suppress(KeyboardInterrupt):
            threading.Event().wait()
    out.print("the laboratory has ended")
    return 0


@app.command
def bridge(
    serial: str,
    /,
    *,
    bench: Path,
    library: str = "usbdll.dll",
    host: str = "127.0.0.1",
    port: Port = 4880,
    token: Path | None = None,
) -> int:
    """Put the TLB-6700 with SERIAL on the network, from the Windows computer that has it.

    One client at a time is served; another is refused meanwhile. Commands that this package has no
    use for are refused, and so is a value beyond the laser's limits.

    Parameters
    ----------
    serial
        Its serial number, such as SN1012.
    bench
        A bench file, for the limits in its `[laser.limits]`.
    library
        The vendor's library, or its path.
    host
        The address to listen at; by default this computer alone.
    port
        HiSLIP's is 4880.
    token
        A file with one line of 16 characters or more, which a client must send first: `token` in
        the `[laser]` of its bench file. Needed where HOST is not this computer alone.
    """
    from fitting.commands.shared._out import console
    from hardware import Bridge, HislipServer, VendorDllLink, read_bench, read_bridge_token

    laser = read_bench(bench).laser
    limits = getattr(laser, "limits", None)
    if limits is None:
        raise CycloptsError(
            msg=f"{bench} has no [laser.limits], and without limits nothing is bridged.",
            command_chain=("bench", "bridge"),
        )
    if token is None and not _is_loopback(host):
        raise CycloptsError(
            msg=f"{host} can be reached by others: give --token, a file that clients know, too.",
            command_chain=("bench", "bridge"),
        )
    secret = "" if token is None else read_bridge_token(token)
    with (
        VendorDllLink(serial, library=library) as link,
        HislipServer(
            Bridge(link, limits=limits.of(), token=secret), port, host=host, alone=True
        ) as server,
    ):
        line = f"{server.resource}; Ctrl-C ends the bridge"
        console(False).print(line, markup=False, soft_wrap=True)
        with contextlib.suppress(KeyboardInterrupt):
            threading.Event().wait()
    console(False).print("the bridge has ended", markup=False)
    return 0


def _is_loopback(host: str) -> bool:
    import ipaddress

    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
