"""The networks that PPO trains: an actor with either head, and a critic that reads more columns."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import create_mlp

from swarm_logistics_env.train.privileged import PRIVILEGED
from swarm_logistics_env.train.training_worlds import check_finite
from swarm_logistics_env.world.motion.classes import GROUPS, outputs_of
from swarm_logistics_env.world.motion.frame import OUTPUTS
from swarm_logistics_env.world.motion.voices import N_MESSAGES


class AsymmetricPolicy(ActorCriticPolicy):  # type: ignore[misc]  # not in the environment of the type check
    """PPO's two networks: the critic reads more columns than the actor, see `NetworkView`.

    Of either head as the base class has them, to the bit, without what it builds and checks around
    every batch.

    Args:
        n_inputs: the columns that the actor reads; the critic reads `PRIVILEGED` as well, and what
            stands behind that is what messages and a teacher should say.
        message_weight: weight of the messages' error, relative to PPO's loss; None: the network
            does not talk.

    Attributes:
        pull: weight of the error beside the teacher, relative to PPO's loss.
        entropy_weight: that of the entropy, where there is a pull or a message.
        tell: takes the messages (n, N_MESSAGES) of the rows for which actions are drawn, where it
            talks. They are what the network estimates, without noise: no action, so what others do
            upon them teaches it nothing.
    """

    def __init__(
        self, *arguments: Any, n_inputs: int, message_weight: float | None = None, **named: Any
    ) -> None:
        self.n_inputs = n_inputs
        self.message_weight = message_weight
        self.pull = 0.0
        self.entropy_weight = 0.0
        self.tell: Callable[[NDArray[np.float32]], None] = lambda messages: None
        super().__init__(*arguments, **named)

    @property
    def talks(self) -> bool:
        """Whether the network says messages."""
        return self.message_weight is not None

    def _build_mlp_extractor(self) -> None:
        self.mlp_extractor = _TwoReaders(self.n_inputs, self.net_arch)
        if self.talks:
            self.message_net = torch.nn.Linear(self.mlp_extractor.latent_dim_pi, N_MESSAGES)

    def forward(self, columns: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Return actions drawn for each row, values and the actions' log probabilities."""
        hidden, values = self._hidden_and_values(columns)
        answers = self._answers(hidden)
        if self.talks:
            self.tell(self._messages(hidden))
        actions, log_probability = self._draw(answers)
        return actions, values, log_probability

    def evaluate_actions(
        self, columns: torch.Tensor, actions: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Return values, and log probabilities and entropies of actions, of each row."""
        hidden, values = self._hidden_and_values(columns)
        answers = self._answers(hidden)
        log_probability, entropy = self._judge(answers, actions)
        # PPO takes the mean of this from its loss, as `ent_coef` is 1 then, see `pull_by`.
        if self.pull > 0.0 or self.talks:
            entropy = self.entropy_weight * entropy
        if self.pull > 0.0:
            error = self.error(answers, columns[:, -len(OUTPUTS) :])
            entropy = entropy - self.pull * error
        if self.message_weight is not None:
            first = self.mlp_extractor.n_columns
            messages = columns[:, first : first + N_MESSAGES]
            error = self._message_error(hidden, messages)
            entropy = entropy - self.message_weight * error
        return values, log_probability, entropy

    def answers_of(self, inputs: torch.Tensor) -> Any:
        """Return what the actor's last layer says upon rows of its inputs."""
        return self.action_net(self.mlp_extractor.policy_net(inputs))

    def messages_of(self, inputs: torch.Tensor) -> NDArray[np.float32]:
        """Return the messages (n, N_MESSAGES) that it tells upon rows of its inputs."""
        return self._messages(self.mlp_extractor.policy_net(inputs))

    def imitation_loss(self, inputs: torch.Tensor, labels: torch.Tensor) -> torch.Tensor:
        """Return the mean error beside labels (n, 3), or with messages behind them."""
        hidden = self.mlp_extractor.policy_net(inputs)
        loss = self.error(self.action_net(hidden), labels[:, : len(OUTPUTS)]).mean()
        if self.message_weight is not None:
            error = self._message_error(hidden, labels[:, len(OUTPUTS) :])
            loss = loss + self.message_weight * error.mean()
        return loss

    def actor_parameters(self) -> Iterator[Any]:
        """Yield what the actor learns."""
        yield from self.mlp_extractor.policy_net.parameters()
        yield from self.action_net.parameters()
        if self.talks:
            yield from self.message_net.parameters()

    def error(self, answers: torch.Tensor, labels: torch.Tensor) -> torch.Tensor:
        """Return how far the last layer's answers are from `NetworkView.labels`, (n,)."""
        raise NotImplementedError

    def likeliest_outputs(self, answers: torch.Tensor) -> NDArray[np.float32]:
        """Return the outputs (n, 3) without noise."""
        raise NotImplementedError

    def _draw(self, answers: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        raise NotImplementedError

    def _judge(
        self, answers: torch.Tensor, actions: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        raise NotImplementedError

    def _hidden_and_values(self, columns: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        for_outputs, for_values = self.mlp_extractor(columns)
        return for_outputs, self.value_net(for_values)

    def _answers(self, hidden: torch.Tensor) -> Any:
        answers = self.action_net(hidden)
        check_finite("an output of the network", answers.detach().cpu().numpy())
        return answers

    def _message_error(self, hidden: torch.Tensor, messages: torch.Tensor) -> torch.Tensor:
        return ((self.message_net(hidden) - messages) ** 2).mean(dim=1)

    def _messages(self, hidden: torch.Tensor) -> NDArray[np.float32]:
        messages: NDArray[np.float32] = self.message_net(hidden).detach().clamp(0, 1).cpu().numpy()
        return messages


class GaussianPolicy(AsymmetricPolicy):
    """The last layer says the outputs, and noise of learned deviations is added to them."""

    def error(self, answers: torch.Tensor, labels: torch.Tensor) -> torch.Tensor:
        """Return the mean square, (n,)."""
        return ((answers - labels) ** 2).mean(dim=1)

    def likeliest_outputs(self, answers: torch.Tensor) -> NDArray[np.float32]:
        """Return the outputs (n, 3) without noise."""
        outputs: NDArray[np.float32] = answers.cpu().numpy()
        return outputs

    def actor_parameters(self) -> Iterator[Any]:
        """Yield what the actor learns, the deviations at the end."""
        yield from super().actor_parameters()
        yield self.log_std

    def _draw(self, answers: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        deviations = self._deviations(answers)
        outputs = answers + torch.empty_like(answers).normal_() * deviations
        return outputs, _log_density(outputs, answers, deviations)

    def _judge(
        self, answers: torch.Tensor, actions: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        deviations = self._deviations(answers)
        entropy = 0.5 + 0.5 * math.log(2.0 * math.pi) + torch.log(deviations)
        return _log_density(actions, answers, deviations), entropy.sum(dim=1)

    def _deviations(self, answers: torch.Tensor) -> torch.Tensor:
        return torch.ones_like(answers) * self.log_std.exp()


class ClassesPolicy(AsymmetricPolicy):
    """The last layer says logits of the groups of classes, and one of each group is drawn.

    Args:
        temperature: what logits are divided by before.
    """

    def __init__(self, *arguments: Any, temperature: float, **named: Any) -> None:
        self.temperature = temperature
        super().__init__(*arguments, **named)

    def error(self, answers: torch.Tensor, labels: torch.Tensor) -> torch.Tensor:
        """Return the cross entropy, the sum of the groups', (n,)."""
        return -_log_probability(_groups(answers), labels.long())

    def likeliest_outputs(self, answers: torch.Tensor) -> NDArray[np.float32]:
        """Return the outputs (n, 3) of the likeliest classes."""
        classes = [group.argmax(dim=1) for group in _groups(answers)]
        return outputs_of(torch.stack(classes, dim=1).cpu().numpy())

    def _draw(self, answers: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        groups = _groups(answers / self.temperature)
        classes = torch.cat([torch.multinomial(group.exp(), 1) for group in groups], dim=1)
        return classes, _log_probability(groups, classes)

    def _judge(
        self, answers: torch.Tensor, actions: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        groups = _groups(answers / self.temperature)
        entropies = [-(group.exp() * group).sum(dim=1) for group in groups]
        return _log_probability(groups, actions.long()), torch.stack(entropies).sum(dim=0)


def _groups(logits: torch.Tensor) -> list[torch.Tensor]:
    """Return the log probabilities (n, k) of the classes of each group."""
    return [group.log_softmax(dim=1) for group in logits.split(GROUPS, dim=1)]


def _log_probability(groups: list[torch.Tensor], classes: torch.Tensor) -> torch.Tensor:
    """Return that of classes (n, 3), one of each group, (n,)."""
    chosen = [group.gather(1, classes[:, [n]]) for n, group in enumerate(groups)]
    return torch.cat(chosen, dim=1).sum(dim=1)


def _log_density(
    outputs: torch.Tensor, means: torch.Tensor, deviations: torch.Tensor
) -> torch.Tensor:
    """Return that of outputs (n, 3) that are distributed normally, (n,)."""
    squares = -((outputs - means) ** 2) / (2 * deviations**2)
    densities = squares - deviations.log() - math.log(math.sqrt(2.0 * math.pi))
    return densities.sum(dim=1)


class _TwoReaders(torch.nn.Module):  # type: ignore[misc]  # torch is Any to mypy
    def __init__(self, n_inputs: int, widths: dict[str, list[int]]) -> None:
        super().__init__()
        self.n_inputs = n_inputs
        self.n_columns = n_inputs + len(PRIVILEGED)
        self.policy_net = torch.nn.Sequential(
            *create_mlp(self.n_inputs, -1, widths["pi"], torch.nn.Tanh)
        )
        # Cheaper than tanh, and as good for values.
        self.value_net = torch.nn.Sequential(
            *create_mlp(self.n_columns, -1, widths["vf"], torch.nn.LeakyReLU)
        )
        self.latent_dim_pi = widths["pi"][-1]
        self.latent_dim_vf = widths["vf"][-1]

    def forward(self, columns: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return self.forward_actor(columns), self.forward_critic(columns)

    def forward_actor(self, columns: torch.Tensor) -> Any:
        return self.policy_net(columns[:, : self.n_inputs])

    def forward_critic(self, columns: torch.Tensor) -> Any:
        return self.value_net(columns[:, : self.n_columns])
