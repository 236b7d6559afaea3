"""The training loop: seeded, resumable after every epoch, ends early where nothing improves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import torch
from torch import Tensor

from defras_bt.learning.training.checkpoint import (
    NAME,
    Epoch,
    described_data,
    described_network,
    read_checkpoint,
    write_checkpoint,
)
from defras_bt.learning.training.encoding import Encoded, Part
from defras_bt.learning.training.trainable import Trainable, batch, device_of
from defras_sim.geometry import Floats


@dataclass(frozen=True)
class Settings:
    """How to train. ``patience``: epochs without a better validation loss after which it ends."""

    seed: int = 0
    epochs: int = 30
    batch: int = 32
    rate: float = 2e-3
    weight_decay: float = 1e-2
    warm_up: float = 0.05
    patience: int = 8


class Training:
    """One training in ``folder``, which holds its checkpoint; go on with :meth:`epochs`.

    Everything random in epoch n depends on the seed and n only, so that a training that was
    interrupted between two epochs gives the same weights as one that was not.
    """

    def __init__(
        self,
        folder: Path,
        model: Trainable,
        settings: Settings,
        parts: Mapping[Part, Encoded],
        *,
        resume: bool,
    ) -> None:
        """With ``resume`` it goes on from the checkpoint, if there is one.

        Raises:
            OtherTraining: the checkpoint is of other settings, another network or other data.
            UnusableCheckpoint: it is cut, or something else.
        """
        self._folder, self._model, self._settings = folder, model, settings
        self._training, self._validation = parts["training"], parts["validation"]
        self._identity = {
            "settings": asdict(settings),
            "network": described_network(model.network),
            "data": described_data(parts),
        }
        self.history: list[Epoch] = []
        named = list(model.network.named_parameters())
        self._names = [name for name, _ in named]
        self._optimizer = torch.optim.AdamW(
            [parameter for _, parameter in named],
            lr=settings.rate,
            weight_decay=settings.weight_decay,
        )
        self._best: dict[str, Tensor] = {}
        folder.mkdir(parents=True, exist_ok=True)
        if resume and (folder / NAME).exists():
            self._resume()

    @property
    def best(self) -> dict[str, Tensor]:
        """The weights of the epoch with the lowest validation loss."""
        return self._best

    def epochs(self) -> Iterator[Epoch]:
        """Train epoch by epoch; a checkpoint stands on disk when each is yielded."""
        while len(self.history) < self._settings.epochs and not self._is_done():
            started, number = perf_counter(), len(self.history) + 1
            training_loss = self._train(number)
            loss = validation_loss(self._model, self._validation)
            best = min([loss, *(e.best_loss for e in self.history[-1:])])
            if loss <= best:
                state = self._model.network.state_dict()
                self._best = {name: tensor.cpu().clone() for name, tensor in state.items()}
            seconds = perf_counter() - started
            self.history.append(Epoch(number, training_loss, loss, best, seconds))
            self._save()
            yield self.history[-1]

    def _is_done(self) -> bool:
        losses = [epoch.validation_loss for epoch in self.history]
        return bool(losses) and len(losses) - 1 - int(np.argmin(losses)) >= self._settings.patience

    def _train(self, number: int) -> float:
        s, data = self._settings, self._training
        rng = np.random.default_rng([s.seed, number])
        order = rng.permutation(len(data))
        batches = np.array_split(order, max(1, round(len(order) / s.batch)))
        weight = head_weights(data, self._model.heads, s.seed)
        device = device_of(self._model)
        self._model.network.train()
        total = 0.0
        for step, rows in enumerate(batches):
            self._set_rate((number - 1 + step / len(batches)) / s.epochs)
            inputs, labels = self._model.varied(
                batch(data, rows, device), _labels(data, rows).to(device), rng
            )
            drawn = weight[torch.from_numpy(rows)].to(device)
            loss = _loss(self._model.logits(inputs), labels, drawn)
            self._optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(self._model.network.parameters(), 1.0)
            self._optimizer.step()
            total += float(loss.detach()) * len(rows)
        return total / len(order)

    def _set_rate(self, progress: float) -> None:
        """Linear warm-up, then half a cosine."""
        s = self._settings
        ramp = min(1.0, progress / s.warm_up) if s.warm_up > 0 else 1.0
        for group in self._optimizer.param_groups:
            group["lr"] = s.rate * ramp * 0.5 * (1 + np.cos(np.pi * progress)) + 1e-6

    def _save(self) -> None:
        tensors = {f"now.{k}": v for k, v in self._model.network.state_dict().items()}
        tensors |= {f"best.{k}": v for k, v in self._best.items()}
        state = self._optimizer.state_dict()["state"]
        for index, name in enumerate(self._names):
            for key in ("step", "exp_avg", "exp_avg_sq"):
                tensors[f"adam.{key}.{name}"] = state[index][key]
        write_checkpoint(self._folder, self._identity, tensors, self.history)

    def _resume(self) -> None:
        tensors, history = read_checkpoint(self._folder, self._identity)
        self._model.network.load_state_dict(_under("now.", tensors))
        self._best = _under("best.", tensors)
        self._optimizer.load_state_dict(
            {
                "state": {
                    index: {
                        key: tensors[f"adam.{key}.{name}"]
                        for key in ("step", "exp_avg", "exp_avg_sq")
                    }
                    for index, name in enumerate(self._names)
                },
                "param_groups": self._optimizer.state_dict()["param_groups"],
            }
        )
        self.history = history


def head_weights(data: Encoded, heads: int, seed: int) -> Tensor:
    """How often (n, heads) each head sees each sample: drawn per tissue, as a bootstrap does.

    Samples of one tissue are alike, so it is whole tissues that count once, twice or not at all.
    """
    if heads == 1:
        return torch.ones(len(data), 1)
    rng = np.random.default_rng(seed)
    shards = [each.key.split("/")[0] for each in data.about]
    names, index = np.unique(shards, return_inverse=True)
    # 0.5 + Poisson(0.5) has a mean of 1 and leaves nothing out altogether.
    drawn = 0.5 + rng.poisson(0.5, size=(len(names), heads))
    return torch.from_numpy(drawn[index]).float()


def _labels(data: Encoded, rows: Any) -> Tensor:
    """Truth and mask (b, 2, 256)."""
    stacked = np.stack([data.truth[rows], data.is_hole[rows]], axis=1)
    return torch.from_numpy(stacked).float()


def _loss(logits: Tensor, labels: Tensor, weight: Tensor) -> Tensor:
    """Mean cross-entropy over the holes, of all heads."""
    truth, mask = labels[:, :1], labels[:, 1:]
    each = torch.nn.functional.binary_cross_entropy_with_logits(
        logits, truth.expand_as(logits), reduction="none"
    )
    return (each * mask * weight[:, :, None]).sum() / (mask.sum() * logits.shape[1])


def all_logits(model: Trainable, data: Encoded, size: int = 64) -> Floats:
    """Logits (n, heads, 256) of all samples."""
    model.network.eval()
    device = device_of(model)
    found = []
    with torch.inference_mode():
        for rows in np.array_split(np.arange(len(data)), max(1, len(data) // size)):
            found.append(model.logits(batch(data, rows, device)).cpu().numpy())
    return np.concatenate(found).astype(float)


def validation_loss(model: Trainable, data: Encoded) -> float:
    """Mean cross-entropy of what the heads say together."""
    logits = all_logits(model, data)
    probability = np.clip((1.0 / (1.0 + np.exp(-logits))).mean(axis=1), 1e-6, 1 - 1e-6)
    each = -np.where(data.truth, np.log(probability), np.log1p(-probability))
    return float(each[data.is_hole].mean())


def _under(prefix: str, tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {k.removeprefix(prefix): v for k, v in tensors.items() if k.startswith(prefix)}
